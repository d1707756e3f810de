"""Viscous friction of a joint."""

import dataclasses

import numpy as np

from drake_disasm.effects.base import JointEffect, JointSamples
from drake_disasm.effects.fields import amplitude, joint_name
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class JointViscousFriction(JointEffect):
    """Friction in proportion to the joint's velocity.

    Equation: tau = b v.
    Where it acts: one joint of the arm, on the torque that its sensor measures.
    """

    joint: str = joint_name()
    coefficient: float = amplitude("N m s/rad", 0.0, 500.0, "viscous coefficient")

    is_filtered = True
    noun = "viscous friction"
    experiment = "this joint at three or more constant speeds, both ways"

    def torque(self, samples: JointSamples) -> np.ndarray:
        """See JointEffect."""
        return self.coefficient * samples.v
