"""The sensor reads differently when loaded than when unloaded."""

import dataclasses

from drake_disasm.common.arrays import Array, last_axis, limited
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

    def begin(self, wrench_S: Array) -> Array:
        """Returns the play centred on the load."""
        return wrench_S

    def remember(self, memory: Array, wrench_S: Array, interval: float) -> Array:
        """Returns where the play has been taken to."""
        width = last_axis([self.width] * 3 + [_LEVER * self.width] * 3, wrench_S)
        return limited(memory, wrench_S - width, wrench_S + width)

    def read(self, wrench_S: Array, memory: Array) -> Array:
        """Returns the reading."""
        return wrench_S + self.column("share") * (memory - wrench_S)
