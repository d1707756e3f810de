"""Where an arm may go, and the posture in which its motions begin and end."""

import dataclasses
from collections.abc import Callable
from typing import Self

import numpy as np
from numpy.typing import NDArray

from drake_disasm.common.errors import DisasmError
from drake_disasm.free_motion.arm_limits import CollisionFreeSpace, JointLimits
from drake_disasm.free_motion.table import MotionTable

Array = NDArray[np.float64]

_POSTURES = 300  # random ones, of which the roomiest is home
_ABOUT = 0.4  # of half a joint's range: how far from home room is looked for
_NEAR = 20  # postures there
_EVERY = 0.05  # s, of a motion, at which postures are looked at
_ON_THE_WAY = 20  # postures on a straight way
_SHRINKS = 8  # halvings of the step in which a motion is made to fit


@dataclasses.dataclass(frozen=True)
class ArmSpace:
    """Where an arm may go: within its limits, clear of itself and of the floor.

    Attributes:
        limits: of its joints.
        collisions: of its links.
        home: (joints,) in which motions begin and end.
        clearance: of links from each other, at least [m].
        floor: height that no moving link's origin may be below [m]; None: any.
        is_allowed: whether all of some postures (n, joints) keep to what else holds.
    """

    limits: JointLimits
    collisions: CollisionFreeSpace
    home: Array
    clearance: float = 0.02
    floor: float | None = None
    is_allowed: Callable[[Array], bool] | None = None

    @classmethod
    def of(
        cls,
        limits: JointLimits,
        collisions: CollisionFreeSpace,
        clearance: float = 0.02,
        floor: float | None = None,
        start: Array | None = None,
        is_allowed: Callable[[Array], bool] | None = None,
    ) -> Self:
        """Returns the space, with the roomiest posture of some random ones as home.

        Args:
            limits, collisions, clearance, floor, is_allowed: see the attributes.
            start: (joints,) from where the straight way there has to be free.

        Raises:
            DisasmError: no posture will do.
        """
        random = np.random.default_rng(0)
        size = _POSTURES, len(limits.names)
        drawn = random.uniform(limits.lower, limits.upper, size)
        if start is not None:
            near = 0.5 * _ABOUT * (limits.upper - limits.lower)
            drawn[::2] = start + near * random.uniform(-1.0, 1.0, size)[::2]
        rest = clearance, floor, is_allowed
        spaces = [cls(limits, collisions, home, *rest) for home in drawn]
        free = [space for space in spaces if space.is_free(space.home[None])]
        for space in sorted(free, key=lambda each: each.room, reverse=True):
            if start is None or space.is_clear(_between(start, space.home), 0.0):
                return space
        raise DisasmError(
            "free space: the arm has none to move in; relax `clearance` or `floor`"
        )

    @property
    def room(self) -> tuple[float, float]:
        """Share of some postures about home that is free, and how central home is."""
        random, limits = np.random.default_rng(0), self.limits
        half = 0.5 * (limits.upper - limits.lower)
        about = self.home + _ABOUT * half * random.uniform(
            -1.0, 1.0, (_NEAR, len(half))
        )
        least = np.minimum(self.home - limits.lower, limits.upper - self.home)
        free = np.mean([self.is_free(q[None]) for q in about])
        return float(free), float(np.min(least / half))

    def is_free(self, q: Array) -> bool:
        """Returns whether postures (n, joints) may all be taken."""
        within = (q >= self.limits.lower) & (q <= self.limits.upper)
        return bool(within.all()) and self.is_clear(q, self.clearance)

    def is_clear(self, q: Array, least: float) -> bool:
        """Returns whether links keep off whatever is there in postures (n, joints).

        Args:
            q: the postures, within the joints' limits or not.
            least: distance of links from each other [m].
        """
        collisions = self.collisions
        if self.is_allowed and not self.is_allowed(q):
            return False
        if self.floor is not None and collisions.height(q).min() < self.floor:
            return False
        if not collisions.has_geometry:
            return True
        return all(collisions.clearance(one[None], least)[0] >= least for one in q)

    def fitted(self, motion: MotionTable) -> MotionTable:
        """Returns a motion, shrunk about home until it is free everywhere.

        Args:
            motion: begins and ends at home.
        """
        every = max(1, round(_EVERY / np.median(np.diff(motion.time))))
        low, high = 0.0, 1.0
        if self.is_free(motion.q[::every]):
            return motion
        for _ in range(_SHRINKS):
            middle = 0.5 * (low + high)
            fits = self.is_free(self._shrunk(motion, middle).q[::every])
            low, high = (middle, high) if fits else (low, middle)
        return self._shrunk(motion, low)

    def _shrunk(self, motion: MotionTable, share: float) -> MotionTable:
        return MotionTable(motion.time, self.home + share * (motion.q - self.home))


def _between(one: Array, other: Array) -> Array:
    """Returns postures (n, joints) on the straight way from one to the other."""
    shares = np.linspace(0.0, 1.0, _ON_THE_WAY)[:, None]
    return np.asarray(one + shares * (other - one))
