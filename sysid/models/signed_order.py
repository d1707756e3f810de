"""In which order, and with which signs, a log has the torques of an arm's joints."""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SignedOrder:
    """Which column of the log each joint's torque is, and with which sign.

    Attributes:
        order: (joints,) number of the column.
        sign: (joints,) 1 or -1.
    """

    order: tuple[int, ...]
    sign: tuple[float, ...]

    @classmethod
    def as_written(cls, joints: int) -> Self:
        """Returns that of a log that is right."""
        return cls(tuple(range(joints)), (1.0,) * joints)

    @property
    def matrix(self) -> Array:
        """(joints, joints), with the right torques = matrix @ the columns."""
        return np.diag(self.sign) @ np.eye(len(self.order))[list(self.order)]

    @property
    def moved(self) -> NDArray[np.int64]:
        """The joints whose torque is not the one written."""
        return np.flatnonzero((self.matrix != np.eye(len(self.order))).any(axis=1))

    @property
    def steps(self) -> int:
        """How many signs and exchanges it takes; all signs at once are one."""
        flips, joints = self.sign.count(-1.0), len(self.order)
        return joints - len(self.cycles) + min(flips, 1 + joints - flips)

    @property
    def cycles(self) -> list[list[int]]:
        """Joints that have each other's columns; a joint with its own is one alone."""
        found: list[list[int]] = []
        seen = set[int]()
        for start in range(len(self.order)):
            cycle = []
            while start not in seen:
                seen.add(start)
                cycle.append(start)
                start = self.order[start]
            found += [cycle] if cycle else []
        return found

    def name(self, joints: Sequence[str]) -> str:
        """Returns the name of this way to write torques.

        Args:
            joints: their names.
        """
        if self.order != tuple(range(len(joints))):
            return "JointOrder"
        flips = [j for j, s in zip(joints, self.sign, strict=True) if s < 0.0]
        return f"TorqueSign.{flips[0]}" if len(flips) == 1 else "TorqueSign"

    def text(self, joints: Sequence[str], column: str = "tau") -> str:
        """Returns it as a clause.

        Args:
            joints: their names.
            column: of the table that is in this order.
        """
        flips = [i for i, s in enumerate(self.sign) if s < 0.0]
        if self.order == tuple(range(len(joints))):
            if len(flips) == len(joints):
                return f"{column} has the other sign at all joints"
            named = [f"{column}.{i} ({joints[i]})" for i in flips]
            has = "has" if len(flips) == 1 else "have"
            return f"{', '.join(named)} {has} the other sign"
        signs = ["-" if sign < 0.0 else "" for sign in self.sign]
        columns = [
            f"{signs[i]}{column}.{self.order[i]} is that of {joints[i]}"
            for i in self.moved
        ]
        return f"columns of {column} are in another order: {', '.join(columns)}"

    @property
    def remedy(self) -> str:
        """What to do with the log."""
        if self.order != tuple(range(len(self.order))):
            return "exchange the columns of tau in the map of import-log"
        return "turn the sign of tau in the map of import-log"

    def flipped(self, joints: Sequence[int]) -> Self:
        """Returns the same with other signs at some joints."""
        sign = [-s if i in joints else s for i, s in enumerate(self.sign)]
        return type(self)(self.order, tuple(sign))

    def exchanged(self, i: int, j: int) -> Self:
        """Returns the same with two joints' columns exchanged."""
        order, sign = list(self.order), list(self.sign)
        order[i], order[j] = order[j], order[i]
        sign[i], sign[j] = sign[j], sign[i]
        return type(self)(tuple(order), tuple(sign))

    def near(self) -> Iterator[Self]:
        """Yields those that differ by one sign, by all signs, or by one exchange."""
        joints = range(len(self.order))
        yield self.flipped(joints)
        if len(joints) > 1:
            yield from (self.flipped([i]) for i in joints)
            yield from (
                self.exchanged(i, j) for i, j in itertools.combinations(joints, 2)
            )

    def simple(self) -> Iterator[Self]:
        """Yields those that one slip makes: `near`, reversed, columns shifted."""
        yield from self.near()
        order, sign = self.order, self.sign
        yield type(self)(order[::-1], sign[::-1])
        for by in range(1, len(order)):
            yield type(self)(order[by:] + order[:by], sign[by:] + sign[:by])
