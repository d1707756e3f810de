"""What a search has evaluated, in order."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass
class Trace:
    """Points and values of every evaluation of a search, in order.

    Attributes:
        points: each (p,).
        values: of the function there.
        cycle_ends: number of evaluations at the end of each cycle.
        stopped: why the search ended; empty while it runs.
    """

    points: list[Array] = field(default_factory=list)
    values: list[float] = field(default_factory=list)
    cycle_ends: list[int] = field(default_factory=list)
    stopped: str = ""

    def add(self, points: Array, values: Array) -> None:
        """Takes a batch of points (b, p) and their values (b,)."""
        self.points += list(np.array(points))
        self.values += [float(value) for value in values]

    @property
    def evaluations(self) -> int:
        """How many there are."""
        return len(self.values)

    @property
    def best(self) -> Array:
        """The point (p,) of the smallest value, the first of equals."""
        return self.points[int(np.argmin(self.values))]

    @property
    def best_value(self) -> float:
        """The smallest value."""
        return min(self.values)

    def best_so_far(self) -> Array:
        """Returns the smallest value (n,) after each evaluation."""
        return np.minimum.accumulate(np.array(self.values))

    def to_mapping(self) -> dict[str, Any]:
        """Returns plain data, of which JSON keeps every bit."""
        return {
            "points": [point.tolist() for point in self.points],
            "values": list(self.values),
            "cycle_ends": list(self.cycle_ends),
            "stopped": self.stopped,
        }

    @classmethod
    def from_mapping(cls, mapping: Mapping[str, Any]) -> Self:
        """Returns the trace that `to_mapping` was called on."""
        return cls(
            [np.array(point) for point in mapping["points"]],
            list(mapping["values"]),
            list(mapping["cycle_ends"]),
            mapping["stopped"],
        )
