"""The sensor reads differently when loaded than when unloaded."""

import dataclasses

import numpy as np

from drake_disasm.effects.base import SensorMemoryEffect
from drake_disasm.effects.fields import amplitude, shape_parameter
from drake_disasm.effects.registry import register_effect

_LEVER = 0.05  # m, by which a width of force becomes one of torque


@register_effect
@dataclasses.dataclass
class SensorHysteresis(SensorMemoryEffect):
    """Internal friction of the sensor's elements: play in part of the reading.

    Equation: F_read = F + a (f - F) with f the play operator of F, half width W for
    forces and 0.05 m W for torques: f = min(max(f, F - W), F + W).
    Where it acts: the sensor's elastic elements.
    """

    share: float = amplitude("1", 0.0, 1.0, "a, share of the reading that has play")
    width: float = shape_parameter(
        2.0, "N", 0.01, 50.0, "W, half width of the play", (0.5, 2.0, 6.0)
    )

    stage = 2
    noun = "hysteresis of the sensor"
    experiment = "loading and unloading along one axis, in small steps"

    def begin(self, wrench_S: np.ndarray) -> np.ndarray:
        """Returns the play centred on the load."""
        return wrench_S

    def remember(
        self, memory: np.ndarray, wrench_S: np.ndarray, interval: float
    ) -> np.ndarray:
        """Returns where the play has been taken to."""
        width = self.width * np.array([1.0, 1.0, 1.0, _LEVER, _LEVER, _LEVER])
        return np.minimum(np.maximum(memory, wrench_S - width), wrench_S + width)

    def read(self, wrench_S: np.ndarray, memory: np.ndarray) -> np.ndarray:
        """Returns the reading."""
        return wrench_S + self.share * (memory - wrench_S)
