"""The thesis's contact law, MSC Adams' IMPACT, between bolt and groove.

Penalty contact between simple shapes: the neck is a circle at either edge of the lips,
the head a disc in its channel. Vectorised over contacts; `systems/impact_contact.py`
puts it into the twin's diagram.
"""

import dataclasses

import numpy as np

from drake_disasm.lock import groove_boxes, head_top, lip_height
from drake_disasm.scenario import ImpactConfig, LockConfig

_MM = 1000.0
_LEAST = 1e-12  # mm: a power of zero has no slope
_RIM_POINTS = 8


@dataclasses.dataclass(frozen=True)
class ImpactLaw:
    """F = max(0, k p^e + step(p, 0, 0, d, c) dp/dt) for p > 0, else 0 (thesis, 4.3).

    `step` is Adams' cubic, c x^2 (3 - 2 x) with x = p / d up to 1. Adams counts in mm,
    and so do the parameters; arguments and results are SI.

    Attributes:
        stiffness: k [N/mm^e].
        exponent: e [1].
        damping: c [N s/mm].
        depth: d [mm], at which damping is full.
    """

    stiffness: float
    exponent: float
    damping: float
    depth: float

    @classmethod
    def of(cls, config: ImpactConfig) -> "ImpactLaw":
        """Returns the law of a scenario's section."""
        return cls(**dataclasses.asdict(config))

    def force(self, penetration: np.ndarray, rate: np.ndarray) -> np.ndarray:
        """Returns the normal force (n,) [N].

        Args:
            penetration: (n,) [m].
            rate: (n,) of the penetration [m/s].
        """
        return self.force_and_slopes(penetration, rate)[0]

    def force_and_slopes(
        self, penetration: np.ndarray, rate: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Returns F [N], dF/dp [N/m] and dF/d(dp/dt) [N s/m], (n,) each."""
        p = np.maximum(penetration * _MM, _LEAST)
        x = np.minimum(p / self.depth, 1.0) if self.depth else np.ones_like(p)
        elastic = self.stiffness * p**self.exponent
        damping = self.damping * x * x * (3.0 - 2.0 * x)
        force = elastic + damping * rate * _MM
        acts = (penetration > 0.0) & (force > 0.0)
        ramp = self.damping * 6.0 * x * (1.0 - x) / max(self.depth, _LEAST)
        slope = elastic * self.exponent / p + ramp * rate * _MM
        return acts * force, acts * slope * _MM, acts * damping * _MM


@dataclasses.dataclass(frozen=True)
class Contacts:
    """Places where bolt and groove could touch, all in G; a row is a place.

    Attributes:
        penetration: (n,) [m], negative where there is a gap.
        normal: (n, 3) out of the groove, towards the bolt.
        arm: (n, 3) from Bo to the place [m].
    """

    penetration: np.ndarray
    normal: np.ndarray
    arm: np.ndarray


class LockShape:
    """The lock as circles and planes."""

    def __init__(self, lock: LockConfig) -> None:
        boxes = groove_boxes(lock)
        self._slot = boxes["lip_left"][0][2]
        self._lips_end = boxes["lip_left"][1][0]
        self._under_lip = boxes["lip_left"][0][1]
        self._wall = boxes["wall_left"][0][2]
        self._floor = boxes["floor"][1][1]
        self._start = boxes["stop_a"][1][0]
        self._end = boxes["stop_b"][0][0]
        self._neck = lock.neck_diameter / 2.0
        self._head = lock.head_diameter / 2.0
        top = head_top(lock)
        lip, bottom = lip_height(lock), top - lock.head_thickness
        self._circles = np.array(
            [[0, lip, 0], [0, -lip, 0], [0, (top + bottom) / 2, 0]]
        )
        angle = 2.0 * np.pi * np.arange(_RIM_POINTS) / _RIM_POINTS
        rim = self._head * np.column_stack([np.cos(angle), 0 * angle, np.sin(angle)])
        self._top_rim = rim + np.array([0.0, top, 0.0])
        self._bottom_rim = rim + np.array([0.0, bottom, 0.0])

    def contacts(self, R_GB: np.ndarray, p_GBo: np.ndarray) -> Contacts:
        """Returns all places for a pose: rotation matrix (3, 3) and origin (3,)."""
        centres = self._circles @ R_GB.T
        upper, lower, head = centres + p_GBo
        groups = [
            self._between(upper, self._neck, self._slot, upper[0] < self._lips_end),
            self._between(lower, self._neck, self._slot, lower[0] < self._lips_end),
            self._between(head, self._head, self._wall, True),
            self._stops(head),
            self._planes(R_GB, p_GBo),
        ]
        parts = [np.concatenate(part) for part in zip(*groups, strict=True)]
        return Contacts(parts[0], parts[1], parts[2] - p_GBo)

    def _between(
        self, centre: np.ndarray, radius: float, wall: float, there: bool
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Returns a circle between two walls at z = -wall and z = wall."""
        side = np.array([1.0, -1.0])
        gap = radius - wall + side * centre[2]
        depth = np.where(there, gap, -1.0)
        normal = -side[:, None] * [0.0, 0.0, 1.0]
        return depth, normal, centre - radius * normal

    def _stops(self, centre: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Returns the head between both ends of its channel."""
        forward = centre[0] + self._head - self._end
        backward = self._start - (centre[0] - self._head)
        normal = np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
        return np.array([forward, backward]), normal, centre - self._head * normal

    def _planes(
        self, R_GB: np.ndarray, p_GBo: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Returns the head's rim between floor and lips."""
        top, bottom = (
            rim @ R_GB.T + p_GBo for rim in (self._top_rim, self._bottom_rim)
        )
        covered = (top[:, 0] < self._lips_end) & (np.abs(top[:, 2]) > self._slot)
        inside = top[:, 1] < self._under_lip + self._head  # not yet lifted out
        above = np.where(covered & inside, top[:, 1] - self._under_lip, -1.0)
        below = self._floor - bottom[:, 1]
        up = np.tile([0.0, 1.0, 0.0], (_RIM_POINTS, 1))
        depth = np.concatenate([above, below])
        return depth, np.vstack([-up, up]), np.vstack([top, bottom])
