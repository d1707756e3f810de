"""Friction of a joint that grows with its load."""

import dataclasses

import numpy as np

from drake_disasm.effects.base import JointEffect, JointSamples
from drake_disasm.effects.fields import amplitude, joint_name, shape_parameter
from drake_disasm.effects.registry import register_effect

#: Below it, filtered velocities can't distinguish a joint from one at rest.
_CREEP = (0.005, 0.02, 0.08)


@register_effect
@dataclasses.dataclass
class JointLoadFriction(JointEffect):
    """Dry friction in proportion to the torque that the gear transmits.

    Equation: tau = k |tau_load| tanh(v / e).
    Where it acts: one joint of the arm, on the torque that its sensor measures.
    """

    joint: str = joint_name()
    coefficient: float = amplitude("1", 0.0, 1.0, "friction per load")
    creep: float = shape_parameter(
        0.02, "rad/s", 1e-4, 0.1, "velocity of the transition", _CREEP
    )

    is_dry = True
    noun = "friction in proportion to the load"
    experiment = "the same motion with two payloads"
    rest_experiment = "each pose reached from both sides, with two payloads"

    def torque(self, samples: JointSamples) -> np.ndarray:
        """See JointEffect."""
        direction = np.tanh(samples.v / self.creep)
        return self.coefficient * np.abs(samples.load) * direction
