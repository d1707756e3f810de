"""The sensor's filter is slow."""

import dataclasses

import numpy as np
from scipy.linalg import solve_banded

from drake_disasm.common.arrays import Array, exponential
from drake_disasm.effects.base import SensorMemoryEffect
from drake_disasm.effects.fields import amplitude, shape_parameter
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class SensorLag(SensorMemoryEffect):
    """A first-order low-pass between load and reading.

    Equation: F_read = F + a (f - F), df/dt = (F - f) / T; with a = 1
    the whole reading is filtered. The load is held constant between samples.
    Where it acts: the filter of the sensor's electronics.
    """

    share: float = amplitude("1", 0.0, 1.0, "a, share of the reading that is filtered")
    time_constant: float = shape_parameter(
        0.1, "s", 0.005, 5.0, "T, of the filter", (0.05, 0.15, 0.5)
    )

    stage = 3
    noun = "a slow filter of the sensor"
    experiment = "fast motion and slow motion over the same path"

    def begin(self, wrench_S: Array) -> Array:
        """Returns the settled filter."""
        return wrench_S

    def remember(self, memory: Array, wrench_S: Array, interval: float) -> Array:
        """Returns the filter's output."""
        stays = exponential(-interval / self.column("time_constant"))
        return wrench_S + stays * (memory - wrench_S)

    def read(self, wrench_S: Array, memory: Array) -> Array:
        """Returns the reading."""
        return wrench_S + self.column("share") * (memory - wrench_S)

    def along(self, wrench_S: Array, times: Array) -> Array:
        """Returns the readings: f_k - s_k f_(k-1) = (1 - s_k) F_k, a band of two."""
        stays = np.exp(-np.diff(times, prepend=-np.inf) / self.time_constant)
        band = np.stack([np.ones(len(stays)), -np.append(stays[1:], 0.0)])
        found = solve_banded((1, 0), band, (1.0 - stays)[:, None] * wrench_S)
        return wrench_S + self.share * (found - wrench_S)
