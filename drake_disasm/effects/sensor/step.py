"""The sensor's zero jumps."""

import dataclasses
from typing import ClassVar

import numpy as np

from drake_disasm.common.arrays import Array, limited
from drake_disasm.effects.base import Reach, Sensing, SensorEffect
from drake_disasm.effects.fields import amplitude, shape_parameter
from drake_disasm.effects.registry import register_effect

_PARTS = 16  # of a log, between which a search for the onset starts
_SLOWEST = 2  # of them, in which it sets in


@register_effect
@dataclasses.dataclass
class SensorStep(SensorEffect):
    """An offset that sets in at some time: a knock, an overload, a cable that moves.

    Equation: F_read = F + b s(t) with b = [fx, fy, fz, tx, ty, tz] in S and s a ramp
    from 0 at t_0 to 1 at t_0 + w; t the time since zeroing, or since the log began
    (readings that only have an order count one second each).
    Where it acts: the reading of the force/torque sensor, after zeroing.
    """

    fx: float = amplitude("N", -50.0, 50.0, "offset of the force along x_S afterwards")
    fy: float = amplitude("N", -50.0, 50.0, "offset of the force along y_S afterwards")
    fz: float = amplitude("N", -50.0, 50.0, "offset of the force along z_S afterwards")
    tx: float = amplitude("N m", -5.0, 5.0, "offset of the torque about x_S afterwards")
    ty: float = amplitude("N m", -5.0, 5.0, "offset of the torque about y_S afterwards")
    tz: float = amplitude("N m", -5.0, 5.0, "offset of the torque about z_S afterwards")
    onset: float = shape_parameter(
        0.8, "s", 0.01, 1e5, "t_0, when it sets in", (0.5, 1.0, 1.5)
    )
    rise: float = shape_parameter(
        0.05, "s", 0.001, 1e4, "w, how long it takes to set in", (0.05,)
    )

    is_of_time = True
    noun = "a step of the sensor's zero"
    present_at_zeroing = False
    experiment = "a rest before and after whatever may have knocked the sensor"
    experiments_against: ClassVar = {
        "SensorWarmUp": "a longer rest: a step does not settle",
        "SensorDrift": "a longer rest: after a step the reading stays",
    }

    @classmethod
    def greatest_shapes(cls, reach: Reach) -> dict[str, float]:
        """See Effect: what sets in more slowly is a drift, or a warm-up."""
        return {"rise": _SLOWEST * reach.duration / _PARTS}

    @classmethod
    def grids(cls, reach: Reach) -> dict[str, tuple[float, ...]]:
        """See Effect: steps so far apart, and so slow, that each finds its nearest."""
        if not np.isfinite(reach.duration):
            return super().grids(reach)
        part = reach.duration / _PARTS
        onsets = part * (np.arange(1.0, _PARTS) - 0.5)
        return {"onset": tuple(onsets.tolist()), "rise": (part,)}

    def apply(self, wrench_S: Array, sensing: Sensing) -> Array:
        """Adds the offset at this time."""
        time = sensing.time[..., None]
        since = (time - self.column("onset")) / self.column("rise")
        set_in = limited(since, 0.0 * since, 1.0 + 0.0 * since)
        return wrench_S + set_in * self.vector(
            wrench_S, "fx", "fy", "fz", "tx", "ty", "tz"
        )
