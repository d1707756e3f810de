"""Friction of a joint that is higher at low speed."""

import dataclasses
from typing import ClassVar

import numpy as np

from drake_disasm.effects.base import JointEffect, JointSamples
from drake_disasm.effects.fields import amplitude, joint_name, shape_parameter
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class JointStribeckFriction(JointEffect):
    """Friction that falls with speed as a film of grease builds up (Stribeck).

    Equation: tau = c tanh(v / e) exp(-(v / v_s)^2), v_s the film's speed
    (Armstrong-Helouvry 1991).
    Where it acts: one joint of the arm, on the torque that its sensor measures.
    """

    joint: str = joint_name()
    size: float = amplitude("N m", 0.0, 200.0, "at breakaway, beyond Coulomb friction")
    speed: float = shape_parameter(
        0.1, "rad/s", 1e-3, 5.0, "v_s, at which the film carries", (0.015, 0.05, 0.15)
    )
    creep: float = shape_parameter(
        0.02, "rad/s", 1e-4, 0.1, "velocity of the transition", (0.02,)
    )

    noun = "friction that falls with speed"
    experiment = "this joint at constant speeds below 0.1 rad/s, both ways"
    experiments_against: ClassVar = {
        "JointCoulombFriction": "slow ramps through zero speed",
    }

    def torque(self, samples: JointSamples) -> np.ndarray:
        """See JointEffect."""
        film = np.exp(-((samples.v / self.speed) ** 2))
        return self.size * np.tanh(samples.v / self.creep) * film
