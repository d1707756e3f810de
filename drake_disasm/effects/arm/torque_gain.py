"""The gain of a joint's torque sensor is off."""

import dataclasses

import numpy as np

from drake_disasm.effects.base import JointEffect, JointSamples
from drake_disasm.effects.fields import amplitude, joint_name
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class TorqueGain(JointEffect):
    """A constant relative error of a joint's torque sensor.

    Equation: tau = g tau_load.
    Where it acts: one joint of the arm, on the torque that its sensor measures.
    """

    joint: str = joint_name()
    share: float = amplitude("1", -0.9, 0.9, "relative error of the torque")

    moves_the_arm = False
    is_filtered = True
    noun = "a gain error of the torque"
    experiment = "the same motion with two known payloads"
    rest_experiment = "the same poses with two known payloads"

    def torque(self, samples: JointSamples) -> np.ndarray:
        """See JointEffect."""
        return self.share * samples.load
