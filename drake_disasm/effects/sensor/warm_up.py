"""The sensor's zero settles as it warms up."""

import dataclasses

from drake_disasm.common.arrays import Array, namespace
from drake_disasm.effects.base import Reach, Sensing, SensorEffect
from drake_disasm.effects.fields import amplitude, shape_parameter
from drake_disasm.effects.registry import register_effect

_GRID = (1.0, 3.0, 10.0, 30.0, 100.0, 300.0)
_SLOWEST = 2.0  # times as long as a log


@register_effect
@dataclasses.dataclass
class SensorWarmUp(SensorEffect):
    """An offset that settles like a first-order system: strain gauges warm up.

    Equation: F_read = F + b (1 - exp(-t / T)) with b = [fx, fy, fz, tx, ty, tz] in S,
    t the time since zeroing, or since the log began (readings that only have an order
    count one second each).
    Where it acts: the reading of the force/torque sensor, after zeroing.
    """

    fx: float = amplitude("N", -50.0, 50.0, "final offset of the force along x_S")
    fy: float = amplitude("N", -50.0, 50.0, "final offset of the force along y_S")
    fz: float = amplitude("N", -50.0, 50.0, "final offset of the force along z_S")
    tx: float = amplitude("N m", -5.0, 5.0, "final offset of the torque about x_S")
    ty: float = amplitude("N m", -5.0, 5.0, "final offset of the torque about y_S")
    tz: float = amplitude("N m", -5.0, 5.0, "final offset of the torque about z_S")
    time_constant: float = shape_parameter(
        30.0, "s", 0.1, 1e4, "T, of the settling", _GRID
    )

    present_at_zeroing = False
    is_of_time = True
    noun = "warm-up of the sensor"
    experiment = "a rest from switching on until the reading stays, pose unchanged"

    @classmethod
    def greatest_shapes(cls, reach: Reach) -> dict[str, float]:
        """See Effect: what settles more slowly is a drift."""
        return {"time_constant": _SLOWEST * reach.duration}

    @classmethod
    def grids(cls, reach: Reach) -> dict[str, tuple[float, ...]]:
        """See Effect: those that are no drift."""
        slowest = cls.greatest_shapes(reach)["time_constant"]
        usual = tuple(value for value in _GRID if value < slowest)
        ends = (slowest,) if slowest < _GRID[-1] else ()
        return {"time_constant": (*usual, *ends)}

    def apply(self, wrench_S: Array, sensing: Sensing) -> Array:
        """Adds the offset at this time."""
        xp = namespace(wrench_S)
        time = sensing.time[..., None]
        settled = -xp.expm1(-time / self.column("time_constant"))
        return wrench_S + settled * self.vector(
            wrench_S, "fx", "fy", "fz", "tx", "ty", "tz"
        )
