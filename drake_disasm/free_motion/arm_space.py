"""Where an arm may go, and the posture in which its motions begin and end."""

import dataclasses
from typing import Self

import numpy as np
from numpy.typing import NDArray

from drake_disasm.common.errors import DisasmError
from drake_disasm.free_motion.arm_limits import CollisionFreeSpace, JointLimits
from drake_disasm.free_motion.table import MotionTable

Array = NDArray[np.float64]

_POSTURES = 300  # random ones, of which the roomiest is home
_CLEAR = 1.5  # times the clearance that is asked for: so is this
_CENTRAL = 0.5  # of half a joint's range: so far from its ends is enough
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
    """

    limits: JointLimits
    collisions: CollisionFreeSpace
    home: Array
    clearance: float = 0.02
    floor: float | None = None

    @classmethod
    def of(
        cls,
        limits: JointLimits,
        collisions: CollisionFreeSpace,
        clearance: float = 0.02,
        floor: float | None = None,
        start: Array | None = None,
    ) -> Self:
        """Returns the space, with the roomiest posture of some random ones as home.

        Args:
            limits, collisions, clearance, floor: see the attributes.
            start: (joints,) from where the straight way there has to be free.

        Raises:
            DisasmError: no posture will do.
        """
        random = np.random.default_rng(0)
        drawn = random.uniform(
            limits.lower, limits.upper, (_POSTURES, len(limits.names))
        )
        spaces = [cls(limits, collisions, q, clearance, floor) for q in drawn]
        for space in sorted(spaces, key=lambda each: -each.room):
            if not space.is_free(space.home[None]):
                continue
            if start is None or space.is_clear(_between(start, space.home), 0.0):
                return space
        raise DisasmError(
            "free space: the arm has none to move in; relax `clearance` or `floor`"
        )

    @property
    def room(self) -> float:
        """How much of it is about home: 1 for enough."""
        limits, collisions = self.limits, self.collisions
        half = 0.5 * (limits.upper - limits.lower)
        least = np.minimum(self.home - limits.lower, limits.upper - self.home)
        found = float(np.min(least / half)) / _CENTRAL
        if collisions.has_geometry:
            most = _CLEAR * self.clearance
            clear = collisions.clearance(self.home[None], most)
            found = min(found, float(clear[0]) / most)
        return min(found, 1.0)

    def is_free(self, q: Array) -> bool:
        """Returns whether postures (n, joints) may all be taken."""
        within = (q >= self.limits.lower) & (q <= self.limits.upper)
        return bool(within.all()) and self.is_clear(q, self.clearance)

    def is_clear(self, q: Array, least: float) -> bool:
        """Returns whether links keep their distance in postures (n, joints).

        Args:
            q: the postures, within the joints' limits or not.
            least: distance of links from each other [m].
        """
        collisions = self.collisions
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
