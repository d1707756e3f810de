"""A constant torque at a joint."""

import dataclasses

import numpy as np

from drake_disasm.effects.base import JointEffect, JointSamples
from drake_disasm.effects.fields import amplitude, joint_name
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class TorqueOffset(JointEffect):
    """A constant torque at a joint: its torque sensor, or its drive, has an offset.

    Equation: tau = c.
    Where it acts: one joint of the arm, on the torque that its sensor measures, or that
    its drive has to give.
    """

    joint: str = joint_name()
    size: float = amplitude("N m", -200.0, 200.0, "the offset")

    is_filtered = True
    noun = "an offset of the torque"
    experiment = "rests of this joint in several poses, each reached from both sides"

    def torque(self, samples: JointSamples) -> np.ndarray:
        """See JointEffect."""
        return np.full_like(samples.v, self.size)
