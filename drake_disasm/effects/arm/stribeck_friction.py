"""The joint rubs more while it is slow."""

import dataclasses

import numpy as np

from drake_disasm.effects.base import JointEffect, JointSamples
from drake_disasm.effects.fields import amplitude, joint_name, shape_parameter
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class JointStribeckFriction(JointEffect):
    """Friction that falls as a film of grease builds up (Stribeck).

    Equation: tau = c tanh(v / e) exp(-(v / v_s)^2), v_s the film's speed
    (Armstrong-Helouvry 1991).
    Where it acts: one joint of the arm, on the torque that its sensor measures.
    """

    joint: str = joint_name()
    size: float = amplitude("N m", 0.0, 200.0, "at breakaway, beyond Coulomb's")
    speed: float = shape_parameter(
        0.1, "rad/s", 1e-3, 5.0, "of the film", (0.05, 0.15, 0.5)
    )
    creep: float = shape_parameter(
        0.02, "rad/s", 1e-4, 1.0, "velocity of the transition", (0.02,)
    )

    def torque(self, samples: JointSamples) -> np.ndarray:
        """See JointEffect."""
        film = np.exp(-((samples.v / self.speed) ** 2))
        return self.size * np.tanh(samples.v / self.creep) * film
