"""The low-pass filters that acted on logs, applied to what a model predicts.

A log's import passes every column through one filter h. Of a torque f(v) it writes
h * f(v); a model that has the filtered velocity predicts f(h * v). Where f is linear
the two are equal. Where it has an edge, as dry friction has at a reversal, the torque's
edge is rounded over 1 / (2 cutoff), the model's is not, and amplitudes come out too
small. h * f(h * v) has its edge at the same place and rounds it in the same way
(parallel filtering of both sides of the equation: Gautier 1997, "Dynamic identification
of robots with power model").
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.signal import oaconvolve

from drake_disasm.importing.importer import low_pass_of
from drake_disasm.importing.signals import LowPass
from drake_disasm.logs import Log
from sysid.models.base import Array


@dataclass(frozen=True)
class LogFilters:
    """The filter of each episode.

    Attributes:
        episodes: rows of each episode, and its filter; None for none.
    """

    episodes: tuple[tuple[slice, LowPass | None], ...]

    @classmethod
    def of(cls, logs: Sequence[Log]) -> Self:
        """Returns the filters that the provenance of logs states."""
        filters = [low_pass_of(log.header) for log in logs for _ in log.episodes]
        counts = [episode.rows for log in logs for episode in log.episodes]
        ends = np.cumsum(counts).tolist()
        rows = [slice(end - n, end) for end, n in zip(ends, counts, strict=True)]
        return cls(tuple(zip(rows, filters, strict=True)))

    def __bool__(self) -> bool:
        """Whether any episode was filtered."""
        return any(low is not None for _, low in self.episodes)

    def __call__(self, torque: Array) -> Array:
        """Returns filtered torques (n, joints) of all rows of all episodes.

        Beyond an episode's ends nothing is known: the kernel's part within is scaled to
        a sum of one. Joints without torque are passed over.
        """
        passed = torque.copy()
        acting = np.flatnonzero(torque.any(axis=0))
        for rows, low in self.episodes:
            if low is not None and len(acting):
                passed[rows, acting] = _smoothed(torque[rows, acting], low)
        return passed


def _smoothed(values: Array, low: LowPass) -> Array:
    """Returns values (n, k) of one episode through its filter."""
    taps = low.kernel()
    reach = min(low.reach, len(values) - 1)
    taps = taps[low.reach - reach : low.reach + reach + 1, None]
    inside = oaconvolve(np.ones((len(values), 1)), taps, mode="same", axes=0)
    return np.asarray(oaconvolve(values, taps, mode="same", axes=0) / inside)
