"""Tables of what episodes show, of bounded length."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.fitting.block_grams import solve
from sysid.monitoring.detector import Array
from sysid.monitoring.linear_episode import EpisodeNumbers
from sysid.monitoring.statistics import Statistics
from sysid.report.thinning import extreme_rows

_ARRAYS = ("values", "right", "grams", "losses", "rows")
_MOST_POINTS = 2000  # of a course: what a figure can show


@dataclass(frozen=True)
class Episodes:
    """What some episodes show, the oldest first; see EpisodeNumbers.

    Attributes:
        values: (n, K) of the statistics; NaN where an episode does not show one.
        right: (n, k) products of the changes' derivatives and the residual.
        grams: (n, q) of each change's derivatives, in single precision.
        losses: (n,) weighted square of the residual.
        rows: (n,) of the episodes.
        names: of the episodes.
    """

    values: Array
    right: Array
    grams: NDArray[np.float32]
    losses: Array
    rows: NDArray[np.int64]
    names: tuple[str, ...] = ()

    @classmethod
    def none(cls, statistics: Statistics) -> "Episodes":
        """Returns no episode."""
        sizes = [len(group) for group in statistics.groups]
        return cls(
            np.zeros((0, len(statistics.all))),
            np.zeros((0, sum(sizes))),
            np.zeros((0, sum(size**2 for size in sizes)), np.float32),
            np.zeros(0),
            np.zeros(0, np.int64),
        )

    def __len__(self) -> int:
        """The number of episodes."""
        return len(self.names)

    def added(self, name: str, numbers: EpisodeNumbers) -> "Episodes":
        """Returns the table with one more episode."""
        return Episodes(
            np.vstack([self.values, numbers.values]),
            np.vstack([self.right, numbers.right]),
            np.vstack([self.grams, numbers.grams.astype(np.float32)]),
            np.append(self.losses, numbers.loss),
            np.append(self.rows, numbers.rows),
            (*self.names, name),
        )

    def select(self, kept: slice) -> "Episodes":
        """Returns some of the episodes."""
        parts = {name: getattr(self, name)[kept] for name in (*_ARRAYS, "names")}
        return Episodes(**parts)

    def last(self, count: int) -> "Episodes":
        """Returns at most so many of the last episodes."""
        return self.select(slice(max(0, len(self) - count), None))

    def gains(self, groups: Sequence[range]) -> Array:
        """Returns by how much each change lowers the loss per episode (G,).

        Its amplitudes are the same in all of the episodes.

        Args:
            groups: numbers of each change's amplitudes.
        """
        right, grams = self.right.sum(axis=0), self.grams.sum(axis=0, dtype=np.float64)
        found, begin = np.zeros(len(groups)), 0
        for number, group in enumerate(groups):
            size = len(group)
            gram = grams[begin : begin + size**2].reshape(size, size)
            own = right[group.start : group.stop]
            found[number] = own @ solve(gram, own) / max(len(self), 1)
            begin += size**2
        return found

    def to_arrays(self, name: str) -> dict[str, NDArray[Any]]:
        """Returns the table as arrays whose names begin with one."""
        parts: dict[str, NDArray[Any]] = {p: getattr(self, p) for p in _ARRAYS}
        parts["names"] = np.array(self.names, dtype=np.str_)
        return {f"{name}_{part}": array for part, array in parts.items()}

    @classmethod
    def from_arrays(cls, name: str, arrays: Mapping[str, NDArray[Any]]) -> "Episodes":
        """Returns what `to_arrays` gave."""
        parts = {part: arrays[f"{name}_{part}"] for part in _ARRAYS}
        return cls(**parts, names=tuple(arrays[f"{name}_names"].tolist()))


@dataclass
class Course:
    """log10 R_n by episode, of bounded length: of old ones only the peaks are kept.

    Attributes:
        points: (n, 2) number of the episode, and log10 R_n.
    """

    points: Array

    def add(self, number: int, value: float) -> None:
        """Adds a point."""
        self.points = np.vstack([self.points, [number, value]])
        if len(self.points) > _MOST_POINTS:
            kept = extreme_rows(self.points[:, 1:], _MOST_POINTS // 2)
            self.points = self.points[kept]
