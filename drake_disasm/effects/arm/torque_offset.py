"""The torque sensor of a joint has an offset."""

import dataclasses

import numpy as np

from drake_disasm.effects.base import JointEffect, JointSamples
from drake_disasm.effects.fields import amplitude, joint_name
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class TorqueOffset(JointEffect):
    """A constant in the reading of a joint's torque sensor.

    Equation: tau = c.
    Where it acts: one joint of the arm, on the torque that its sensor measures.
    """

    joint: str = joint_name()
    size: float = amplitude("N m", -200.0, 200.0, "offset of the reading")

    noun = "an offset of the torque"
    experiment = "rests of this joint in several poses, each reached from both sides"

    def torque(self, samples: JointSamples) -> np.ndarray:
        """See JointEffect."""
        return np.full_like(samples.v, self.size)
