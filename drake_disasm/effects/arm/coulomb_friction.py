"""Dry friction of a joint."""

import dataclasses
from typing import ClassVar

import numpy as np

from drake_disasm.effects.base import JointEffect, JointSamples
from drake_disasm.effects.fields import amplitude, joint_name, shape_parameter
from drake_disasm.effects.registry import register_effect

#: Below it, filtered velocities can't distinguish a joint from one at rest.
_CREEP = (0.005, 0.02, 0.08)


@register_effect
@dataclasses.dataclass
class JointCoulombFriction(JointEffect):
    """Dry friction of constant size against the motion.

    Equation: tau = c tanh(v / e), e the velocity below which the joint creeps.
    Where it acts: one joint of the arm, on the torque that its sensor measures.
    """

    joint: str = joint_name()
    size: float = amplitude("N m", 0.0, 200.0, "friction torque")
    creep: float = shape_parameter(
        0.02, "rad/s", 1e-4, 0.1, "velocity of the transition", _CREEP
    )

    is_dry = True
    noun = "dry friction"
    experiment = "this joint at three or more constant speeds, both ways"
    rest_experiment = (
        "each pose reached from both sides by this joint: half the difference of its "
        "torques is dry friction"
    )
    experiments_against: ClassVar = {
        "JointViscousFriction": "three or more constant speeds",
        "JointLoadFriction": "the same motion with two payloads",
    }

    def torque(self, samples: JointSamples) -> np.ndarray:
        """See JointEffect."""
        return self.size * np.tanh(samples.v / self.creep)
