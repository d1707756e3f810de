"""The measured pose comes late."""

import dataclasses
from typing import ClassVar

import numpy as np

from drake_disasm.effects.base import LONGEST_POSE_MEMORY, PoseEffect
from drake_disasm.effects.fields import amplitude
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class PoseDelay(PoseEffect):
    """The measured pose comes late by a fixed time, the wrench does not.

    Equation: X_read(t) = X(t - T), position and rotation vector at constant velocity
    within a step of the MDP; before the episode the bolt was at A.
    Where it acts: between the arm's encoders and whoever reads them: a buffer, a bus,
    or a log whose rows have been shifted. The motion itself is on time.
    """

    delay: float = amplitude("s", 0.0, LONGEST_POSE_MEMORY, "T, of the measured pose")

    noun = "a pose that comes late"
    experiment = "a stop that is hit at speed: wrench and pose, on one clock"
    experiments_against: ClassVar = {
        "MotionLag": "a stop that is hit: the wrench is late, too, if the motion is",
        "Backlash": "reversals at several speeds: a delay grows with speed",
    }

    def weights(self, period: float) -> np.ndarray:
        """See PoseEffect: of the two poses between which the delay ends."""
        whole, part = divmod(self.delay / period, 1.0)
        found = np.zeros(int(whole) + 1 + (part > 0.0))
        found[int(whole)] = 1.0 - part
        found[int(whole) + 1 :] = part
        return found
