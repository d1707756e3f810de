"""The sensor runs out of range."""

import dataclasses

from drake_disasm.common.arrays import Array, last_axis, limited
from drake_disasm.effects.base import Sensing, SensorEffect
from drake_disasm.effects.fields import amplitude, shape_parameter
from drake_disasm.effects.registry import register_effect

_LEVER = 0.05  # m, by which a range of force becomes one of torque


@register_effect
@dataclasses.dataclass
class SensorSaturation(SensorEffect):
    """Beyond a limit the reading grows less, or not at all.

    Equation: F_read = F - a (F - clip(F, -L, L)) per channel, L for forces and
    0.05 m L for torques; a = 1 is a hard limit.
    Where it acts: the range of the sensor's electronics.
    """

    share: float = amplitude("1", 0.0, 1.0, "a, share lost of what exceeds the limit")
    limit: float = shape_parameter(
        10.0, "N", 0.1, 1000.0, "L, of the range", (3.0, 6.0, 12.0)
    )

    stage = 4
    noun = "saturation of the sensor"
    experiment = "loads near the end of the range, along each axis"

    def apply(self, wrench_S: Array, sensing: Sensing) -> Array:
        """Removes what is lost beyond the limit."""
        limit = last_axis([self.limit] * 3 + [_LEVER * self.limit] * 3, wrench_S)
        held = limited(wrench_S, -limit, limit)
        return wrench_S - self.column("share") * (wrench_S - held)
