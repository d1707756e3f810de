"""The sensor's readings come late."""

import dataclasses
from typing import ClassVar

import numpy as np

from drake_disasm.common.arrays import Array
from drake_disasm.effects.base import SensorMemoryEffect
from drake_disasm.effects.fields import amplitude, shape_parameter
from drake_disasm.effects.history import History
from drake_disasm.effects.registry import register_effect

_LONGEST = 0.3  # s
_HISTORY = History(size=6, samples=32, longest=_LONGEST)


@register_effect
@dataclasses.dataclass
class SensorDelay(SensorMemoryEffect):
    """The wrench comes late by a fixed time: a transport delay, whole samples or not.

    Equation: F_read(t) = F(t) + a (F(t - T) - F(t)), the load between two samples on
    the straight line through them; before the first sample the load was at rest.
    Where it acts: between the sensor's electronics and whoever reads it: a buffer, a
    bus, or a log whose rows have been shifted.
    """

    share: float = amplitude("1", 0.0, 1.0, "a, share of the reading that is late")
    delay: float = shape_parameter(
        0.1,
        "s",
        0.0,
        _LONGEST,
        "T, of the wrench behind the load",
        (0.03, 0.06, 0.1, 0.2),
    )

    memory_size = _HISTORY.numbers
    noun = "readings that come late"
    stage = 5
    experiment = "steps that hit a stop, and an impulse: a delay shifts it, unchanged"
    experiments_against: ClassVar = {
        "SensorLag": "a knock: a delay shifts it unchanged, a filter makes it longer",
        "MotionLag": "motion in free space: the measured pose is late then, too",
    }

    def begin(self, wrench_S: Array) -> Array:
        """Returns a history of nothing but this load."""
        return _HISTORY.begin(wrench_S)

    def remember(self, memory: Array, wrench_S: Array, interval: float) -> Array:
        """Returns the history with one more sample."""
        return _HISTORY.extended(memory, wrench_S, interval)

    def read(self, wrench_S: Array, memory: Array) -> Array:
        """Returns the load of a while ago, as far as it is late."""
        before = _HISTORY.at(memory, self.column("delay"))
        return wrench_S + self.column("share") * (before - wrench_S)

    def along(self, wrench_S: Array, times: Array) -> Array:
        """Returns the loads of a while ago, as far as they are late."""
        then = times - self.delay
        before = [np.interp(then, times, channel) for channel in wrench_S.T]
        return wrench_S + self.share * (np.transpose(before) - wrench_S)
