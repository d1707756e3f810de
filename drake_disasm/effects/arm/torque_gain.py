"""The torque sensor reads too much or too little."""

import dataclasses

import numpy as np

from drake_disasm.effects.base import JointEffect, JointSamples
from drake_disasm.effects.fields import amplitude, joint_name
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class TorqueGain(JointEffect):
    """A share of the torque, too much.

    Equation: tau = g tau_load.
    Where it acts: one joint of the arm, on the torque that its sensor measures.
    """

    joint: str = joint_name()
    share: float = amplitude("1", -0.9, 0.9, "too much")

    def torque(self, samples: JointSamples) -> np.ndarray:
        """See JointEffect."""
        return self.share * samples.load
