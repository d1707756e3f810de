"""The sensor runs out of range."""

import dataclasses

import numpy as np

from drake_disasm.effects.base import Sensing, SensorEffect
from drake_disasm.effects.fields import amplitude, shape_parameter
from drake_disasm.effects.registry import register_effect

_LEVER = 0.05  # m: how a range of force and one of torque belong together


@register_effect
@dataclasses.dataclass
class SensorSaturation(SensorEffect):
    """Beyond a limit the reading grows less, or not at all.

    Equation: F_read = F - a (F - clip(F, -L, L)) per channel, L for forces and
    0.05 m L for torques; a = 1 is a hard limit.
    Where it acts: the range of the sensor's electronics.
    """

    share: float = amplitude("1", 0.0, 1.0, "a, of what exceeds the limit, is lost")
    limit: float = shape_parameter(10.0, "N", 0.1, 1000.0, "L", (3.0, 6.0, 12.0))

    stage = 4

    def apply(self, wrench_S: np.ndarray, sensing: Sensing) -> np.ndarray:
        """Takes off what is lost."""
        limit = self.limit * np.array([1.0, 1.0, 1.0, _LEVER, _LEVER, _LEVER])
        held = np.minimum(np.maximum(wrench_S, -limit), limit)
        return wrench_S - self.share * (wrench_S - held)
