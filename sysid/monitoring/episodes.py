"""Tables of what episodes show, of bounded length."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid.monitoring.detector import Array
from sysid.monitoring.statistics import EpisodeNumbers
from sysid.report.thinning import extreme_rows

_MOST_POINTS = 2000  # of a course: what a figure can show


@dataclass(frozen=True)
class Episodes:
    """What some episodes show, the oldest first.

    Attributes:
        values: (n, K) of the statistics; NaN where an episode does not show one.
        shares: (n, K) of the squared residual that a change takes away.
        rows: (n,) of the episodes.
        names: of the episodes.
    """

    values: Array
    shares: Array
    rows: NDArray[np.int64]
    names: tuple[str, ...] = ()

    @classmethod
    def none(cls, size: int) -> "Episodes":
        """Returns no episode of K statistics."""
        nothing = np.zeros((0, size))
        return cls(nothing, nothing, np.zeros(0, np.int64))

    def __len__(self) -> int:
        """The number of episodes."""
        return len(self.names)

    def added(self, name: str, numbers: EpisodeNumbers) -> "Episodes":
        """Returns the table with one more episode."""
        return Episodes(
            np.vstack([self.values, numbers.values]),
            np.vstack([self.shares, numbers.shares]),
            np.append(self.rows, numbers.rows),
            (*self.names, name),
        )

    def last(self, count: int) -> "Episodes":
        """Returns at most so many of the last episodes."""
        kept = slice(max(0, len(self) - count), None)
        return Episodes(
            self.values[kept], self.shares[kept], self.rows[kept], self.names[kept]
        )

    def to_arrays(self, name: str) -> dict[str, NDArray[Any]]:
        """Returns the table as arrays whose names begin with one."""
        return {
            f"{name}_values": self.values,
            f"{name}_shares": self.shares,
            f"{name}_rows": self.rows,
            f"{name}_names": np.array(self.names, dtype=np.str_),
        }

    @classmethod
    def from_arrays(cls, name: str, arrays: Mapping[str, NDArray[Any]]) -> "Episodes":
        """Returns what `to_arrays` gave."""
        values, shares, rows, names = (
            arrays[f"{name}_{part}"] for part in ("values", "shares", "rows", "names")
        )
        return cls(values, shares, rows, tuple(names.tolist()))


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
