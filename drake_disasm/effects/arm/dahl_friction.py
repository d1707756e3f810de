"""Friction of a joint that builds up over a displacement: pre-sliding."""

import dataclasses
from typing import ClassVar

import numpy as np

from drake_disasm.effects.base import JointMemoryEffect
from drake_disasm.effects.fields import amplitude, joint_name, shape_parameter
from drake_disasm.effects.registry import register_effect

_TWO_SPEEDS = (
    "the same reversals at two speeds: a delay is a time, and the displacement over "
    "which the torque turns grows with the speed"
)


@register_effect
@dataclasses.dataclass
class JointDahlFriction(JointMemoryEffect):
    """Pre-sliding friction: after a reversal it builds up over a displacement.

    Equation: dF/dq = (F_c sgn(v) - F) / x_s, so that F approaches F_c sgn(v) as
    exp(-|q - q_r| / x_s) from where the joint turned, q_r (Dahl 1968, "A solid friction
    model", with the exponent 1 and the stiffness F_c / x_s).
    Where it acts: one joint of the arm, on the torque that its sensor measures. It
    depends on the path alone, not on the speed; with a short x_s it is dry friction.
    At the beginning of an episode F is zero: where the joint came from is not recorded.
    Noise of the position counts as motion, and lets F fall while the joint is at rest.
    """

    joint: str = joint_name()
    size: float = amplitude("N m", 0.0, 200.0, "F_c, when it slides")
    displacement: float = shape_parameter(
        0.002, "rad", 1e-4, 0.05, "x_s, over which it builds up", (5e-4, 5e-3)
    )

    needs_both_ways = True
    noun = "pre-sliding friction"
    experiment = "reversals of this joint, slow and fast ones over the same path"
    experiments_against: ClassVar = {
        "JointCoulombFriction": "slow reversals over ever smaller paths: dry friction "
        "jumps in each, this one does not reach its size",
        "JointStribeckFriction": "reversals at several constant speeds: this friction "
        "is the same at all",
        "JointDelay": _TWO_SPEEDS,
        "ArmDelay": _TWO_SPEEDS,
        "JointElasticity": "slow reversals over the same path: a spring's torque is "
        "the same both ways, friction leaves a loop",
    }

    def remember(self, memory: np.ndarray, displacement: np.ndarray) -> np.ndarray:
        """See JointMemoryEffect: F / F_c, forwards towards 1, backwards towards -1."""
        distance = np.abs(displacement)
        forwards = 0.5 * (distance + displacement) / self.displacement
        backwards = 0.5 * (distance - displacement) / self.displacement
        memory = 1.0 - (1.0 - memory) * np.exp(-forwards)
        return (1.0 + memory) * np.exp(-backwards) - 1.0

    def torque(self, memory: np.ndarray) -> np.ndarray:
        """See JointMemoryEffect."""
        return self.size * memory
