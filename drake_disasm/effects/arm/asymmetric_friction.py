"""Friction of a joint that depends on the direction of motion."""

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
class JointAsymmetricFriction(JointEffect):
    """Friction that differs by direction: half of forwards minus backwards.

    Equation: tau = c tanh(v / e)^2 + b |v|: even in v, and zero at rest.
    Where it acts: one joint of the arm, on the torque that its sensor measures.
    """

    joint: str = joint_name()
    coulomb: float = amplitude("N m", -200.0, 200.0, "dry part")
    viscous: float = amplitude("N m s/rad", -500.0, 500.0, "viscous part")
    creep: float = shape_parameter(
        0.02, "rad/s", 1e-4, 0.1, "velocity of the transition", _CREEP
    )

    needs_both_ways = True
    noun = "friction that depends on the direction"
    experiment = "this joint both ways at the same speeds, with rests"
    experiments_against: ClassVar = {
        "TorqueOffset": "rests: an offset is there at rest",
    }

    def torque(self, samples: JointSamples) -> np.ndarray:
        """See JointEffect."""
        dry = self.coulomb * np.tanh(samples.v / self.creep) ** 2
        return dry + self.viscous * np.abs(samples.v)
