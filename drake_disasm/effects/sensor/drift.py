"""The sensor's zero drifts."""

import dataclasses
from typing import ClassVar

from drake_disasm.common.arrays import Array, limited
from drake_disasm.effects.base import Sensing, SensorEffect
from drake_disasm.effects.fields import amplitude, shape_parameter
from drake_disasm.effects.registry import register_effect

_NEVER = 1e6  # s
_GRID = (_NEVER, 10.0, 30.0, 50.0, 100.0, 300.0)


@register_effect
@dataclasses.dataclass
class SensorDrift(SensorEffect):
    """An offset that grows with time since zeroing, or since the log began.

    Equation: F_read = F + d min(t, T) with d = [fx, fy, fz, tx, ty, tz] in S, t in
    seconds. (Readings that only have an order count one second each.) With the
    default T it never ends.
    Where it acts: the reading of the force/torque sensor, after zeroing.
    """

    fx: float = amplitude("N/s", -5.0, 5.0, "drift of the force along x_S")
    fy: float = amplitude("N/s", -5.0, 5.0, "drift of the force along y_S")
    fz: float = amplitude("N/s", -5.0, 5.0, "drift of the force along z_S")
    tx: float = amplitude("N m/s", -0.5, 0.5, "drift of the torque about x_S")
    ty: float = amplitude("N m/s", -0.5, 0.5, "drift of the torque about y_S")
    tz: float = amplitude("N m/s", -0.5, 0.5, "drift of the torque about z_S")
    duration: float = shape_parameter(
        _NEVER, "s", 1.0, _NEVER, "T, at which it ends", _GRID
    )

    present_at_zeroing = False
    is_of_time = True
    noun = "a drift of the sensor"
    experiment = "the first pose again at the end, and a rest of some minutes"
    task_experiment = "the first steps again at the end, with a rest before them"
    experiments_against: ClassVar = {
        "SensorWarmUp": "a longer rest: a warm-up ends, a drift goes on",
    }

    def apply(self, wrench_S: Array, sensing: Sensing) -> Array:
        """Adds the offset at this time."""
        time = sensing.time[..., None]
        elapsed = limited(time, 0.0 * time, 0.0 * time + self.column("duration"))
        return wrench_S + elapsed * self.vector(
            wrench_S, "fx", "fy", "fz", "tx", "ty", "tz"
        )
