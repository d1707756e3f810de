"""The low-pass filters that acted on logs, applied to what a model predicts.

A log's import passes every column through one filter h. Of a torque f(v) it writes
h * f(v); a model that has the filtered velocity predicts f(h * v). Where f is linear
the two are equal. Where it has an edge, as dry friction has at a reversal, the torque's
edge is rounded over 1 / (2 cutoff), the model's is not, and amplitudes come out wrong.
h * f(h * v) has its edge at the same place and rounds it in the same way (parallel
filtering of both sides of an equation of motion: Gautier 1997, "Dynamic identification
of robots with power model").
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.signal import oaconvolve

from drake_disasm.effects import ArmEffect, ArmSamples
from drake_disasm.logs import Log, LogHeader
from drake_disasm.logs.importing.importer import low_pass_of
from drake_disasm.logs.importing.signals import LowPass, resample
from sysid.models.arm_motion import ArmMotion, torque_of
from sysid.models.base import Array
from sysid.models.path_memory import PathMemory

_POINTS = 40.0  # per period of the cut-off: an edge between two is off by 1 %


@dataclass(frozen=True)
class LogFilter:
    """The filter of an episode, between whose rows torques are evaluated, too.

    Decimated rows hold all of a smooth torque, but not where exactly it had an edge.

    Attributes:
        low: at the rate of these points; None for no filter.
        points: for each row.
    """

    low: LowPass | None = None
    points: int = 1

    @classmethod
    def of(cls, header: LogHeader) -> Self:
        """Returns the filter that a log's provenance states."""
        recorded, period = low_pass_of(header), header.period
        if recorded is None or period is None:
            return cls()
        enough = math.ceil(_POINTS * recorded.cutoff * period)
        points = min(enough, round(period / recorded.period))
        return cls(LowPass(recorded.cutoff, period / points), points)

    def between(self, values: Array) -> Array:
        """Returns values (n, k) at all points (n points, k)."""
        rows = np.arange(len(values), dtype=float)
        at = np.arange(len(values) * self.points) / self.points
        return values if self.points == 1 else resample(rows, values, at)

    def __call__(self, torque: Array) -> Array:
        """Returns torques (n points, k) of one episode as its rows have them (n, k).

        Beyond an episode's ends nothing is known: the kernel's part within is scaled to
        a sum of one.
        """
        if self.low is None:
            return torque
        taps, rows = self.low.kernel(), len(torque)
        reach = min(self.low.reach, rows - 1)
        taps = taps[self.low.reach - reach : self.low.reach + reach + 1, None]
        inside = oaconvolve(np.ones((rows, 1)), taps, mode="same", axes=0)
        passed = oaconvolve(torque, taps, mode="same", axes=0)
        return np.asarray(passed / inside)[:: self.points]


def log_filters(logs: Sequence[Log]) -> tuple[LogFilter, ...]:
    """Returns the filter of each episode; none if no log was filtered."""
    filters = [LogFilter.of(log.header) for log in logs for _ in log.episodes]
    return tuple(filters) if any(each.low for each in filters) else ()


class FilteredTorques:
    """Torques of effects along a motion, through the filters of its episodes.

    Args:
        motion: all samples of all episodes.
        filters: of each episode.
    """

    def __init__(self, motion: ArmMotion, filters: Sequence[LogFilter]) -> None:
        self._joints, self.filters = motion.joints, tuple(filters)
        ends = np.flatnonzero(np.diff(motion.episode)) + 1
        self._ends: NDArray[np.int64] = ends
        points = [each.points for each in filters]
        rows = np.diff(np.array([0, *ends, len(motion.time)]))
        counts: NDArray[np.int64] = rows * np.array(points)
        self._point_ends = np.cumsum(counts)[:-1]
        q, v, vd = (self._between(each) for each in (motion.q, motion.v, motion.vd))
        self._motion = q, v, vd
        episode = np.repeat(np.arange(len(filters)), counts)
        self._paths = PathMemory(motion.joints, episode, q)
        self._load = np.full_like(motion.q, np.nan), q

    def __call__(self, load: Array, effects: Sequence[ArmEffect]) -> Array:
        """Returns the filtered sum of what effects add to the load, (n, joints).

        Args:
            load: (n, joints) torques of the rigid bodies at all samples.
            effects: each with torques of its own.
        """
        if not np.array_equal(load, self._load[0]):  # the same for most of a survey
            self._load = load, self._between(load)
        samples = ArmSamples(self._joints, *self._motion, self._load[1])
        torque = np.zeros_like(samples.load)
        for effect in effects:
            torque += torque_of(effect, samples, self._paths, slice(None))
        passed = np.zeros_like(load)
        acting = np.flatnonzero(torque.any(axis=0))
        parts = np.split(torque[:, acting], self._point_ends)
        pairs = zip(self.filters, parts, strict=True)
        passed[:, acting] = np.concatenate([low(part) for low, part in pairs])
        return passed

    def _between(self, values: Array) -> Array:
        """Returns values (n, k) of all samples at all points of their episodes."""
        parts = zip(self.filters, np.split(values, self._ends), strict=True)
        return np.concatenate([low.between(part) for low, part in parts])
