"""The arm follows its command late."""

import dataclasses

from drake_disasm.common.arrays import Array, at_most
from drake_disasm.effects.base import Memory, MotionEffect
from drake_disasm.effects.fields import amplitude
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class MotionLag(MotionEffect):
    """A dead time between command and motion.

    Equation: d_executed(t) = d_commanded(t - delay), the command at constant velocity
    within a step; delays beyond one step of the MDP count as one step. For slow
    motion a first-order lag of that time constant looks the same.
    Where it acts: on the commanded pose, before inverse kinematics.
    """

    delay: float = amplitude("s", 0.0, 0.1, "of the motion behind its command")

    stage = 1
    noun = "a delay of the motion"
    experiment = "fast and slow steps over the same path in free space"

    def execute(
        self, commanded: Array, wrench: Array, memory: Memory, period: float
    ) -> tuple[Array, Memory]:
        """See MotionEffect; the memory is the command before."""
        share = at_most(1.0, self.column("delay") / period)
        return commanded + share * (memory - commanded), commanded
