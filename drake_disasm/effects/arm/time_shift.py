"""Torques and motion that were not recorded at the same time."""

import dataclasses
from collections.abc import Sequence

from drake_disasm.effects.base import DelayEffect
from drake_disasm.effects.fields import amplitude, joint_name
from drake_disasm.effects.registry import register_effect

_MOST = 0.1  # s: more is another recording


@register_effect
@dataclasses.dataclass
class ArmDelay(DelayEffect):
    """Torques and motion are shifted in time: two clocks, buses or filters.

    Equation: tau(t) = tau_0(t - T), T the same at all joints. A motion that comes late,
    by an encoder's filter say, is a negative T.
    Where it acts: every joint of the arm, on the torques that their sensors measure. It
    can't be told from a drive that lags or a coupling that yields.
    """

    delay: float = amplitude("s", -_MOST, _MOST, "T, of the torque after the motion")

    noun = "a shift in time between torque and motion"
    experiment = "fast reversals, with torques and motion stamped by one clock"

    def delays(self, joint: str) -> bool:
        """See DelayEffect: all of them."""
        return True


@register_effect
@dataclasses.dataclass
class JointDelay(DelayEffect):
    """The torque of one joint is shifted in time against the motion.

    Equation: tau(t) = tau_0(t - T). A motion that comes late is a negative T.
    Where it acts: one joint of the arm, on the torque that its sensor measures.
    """

    joint: str = joint_name()
    delay: float = amplitude("s", -_MOST, _MOST, "T, of the torque after the motion")

    noun = "a shift in time of one torque"
    experiment = "fast reversals of this joint, all stamped by one clock"

    @classmethod
    def places(cls, joints: Sequence[str]) -> list[dict[str, str]]:
        """See ArmEffect; of a single joint, ArmDelay is the same."""
        return super().places(joints) if len(joints) > 1 else []

    def delays(self, joint: str) -> bool:
        """See DelayEffect: its own."""
        return joint == self.joint
