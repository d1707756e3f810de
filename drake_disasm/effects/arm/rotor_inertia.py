"""Inertia of a joint's rotor and gear."""

import dataclasses

import numpy as np

from drake_disasm.effects.base import JointEffect, JointSamples
from drake_disasm.effects.fields import amplitude, joint_name
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class RotorInertia(JointEffect):
    """Inertia of rotor and gear, reflected to the joint.

    Equation: tau = I_a vd: unlike a link's inertia it couples to no other joint.
    Where it acts: one joint of the arm, on the torque that its sensor measures.
    """

    joint: str = joint_name()
    inertia: float = amplitude("kg m^2", 0.0, 50.0, "reflected to the joint")

    is_filtered = True
    noun = "inertia of the rotor"
    experiment = "fast reversals of this joint alone, the others at rest"

    def torque(self, samples: JointSamples) -> np.ndarray:
        """See JointEffect."""
        return self.inertia * samples.vd
