"""The joint rubs."""

import dataclasses

import numpy as np

from drake_disasm.effects.base import JointEffect, JointSamples
from drake_disasm.effects.fields import amplitude, joint_name, shape_parameter
from drake_disasm.effects.registry import register_effect

#: Below it a joint rests, for all that filtered velocities can tell.
_CREEP = (0.005, 0.02, 0.08)


@register_effect
@dataclasses.dataclass
class JointCoulombFriction(JointEffect):
    """Dry friction of constant size against the motion.

    Equation: tau = c tanh(v / e), e the speed below which the joint creeps.
    Where it acts: one joint of the arm, on the torque that its sensor measures.
    """

    joint: str = joint_name()
    size: float = amplitude("N m", 0.0, 200.0, "friction torque")
    creep: float = shape_parameter(
        0.02, "rad/s", 1e-4, 1.0, "velocity of the transition", _CREEP
    )

    def torque(self, samples: JointSamples) -> np.ndarray:
        """See JointEffect."""
        return self.size * np.tanh(samples.v / self.creep)
