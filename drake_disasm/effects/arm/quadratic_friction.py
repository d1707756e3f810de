"""Friction of a joint that grows with the square of its load."""

import dataclasses
from typing import ClassVar

import numpy as np

from drake_disasm.effects.base import JointEffect, JointSamples
from drake_disasm.effects.fields import amplitude, joint_name, shape_parameter
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class JointQuadraticFriction(JointEffect):
    """Dry friction in proportion to the square of the torque the gear transmits.

    Equation: tau = k tau_load^2 tanh(v / e) (Duclusaud, Passault, Padois and Ly 2025,
    their model M6, without its other terms).
    Where it acts: one joint of the arm, on the torque that its sensor measures.
    """

    joint: str = joint_name()
    coefficient: float = amplitude("1/(N m)", 0.0, 10.0, "friction per squared load")
    creep: float = shape_parameter(
        0.02, "rad/s", 1e-4, 0.1, "velocity of the transition", (0.02,)
    )

    is_dry = True
    noun = "friction that grows with the square of the load"
    experiment = "the same motion with three payloads"
    rest_experiment = "each pose reached from both sides, with three payloads"
    experiments_against: ClassVar = {
        "JointLoadFriction": "the same motion with three payloads",
    }

    def torque(self, samples: JointSamples) -> np.ndarray:
        """See JointEffect."""
        direction = np.tanh(samples.v / self.creep)
        return self.coefficient * samples.load**2 * direction
