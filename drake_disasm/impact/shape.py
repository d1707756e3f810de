"""The lock as circles and planes, for penalty contact.

The neck is a circle at either edge of the lips, the head a disc in its channel.
Vectorised over poses and over places.
"""

import dataclasses

import numpy as np

from drake_disasm.cell.lock_dimensions import groove_boxes, head_top, lip_height
from drake_disasm.scenario import LockConfig

_RIM_POINTS = 8
_SIDES = np.array([1.0, -1.0])
_UP = np.array([0.0, 1.0, 0.0])
_ALONG = np.array([1.0, 0.0, 0.0])
_ACROSS = np.array([0.0, 0.0, 1.0])


@dataclasses.dataclass(frozen=True)
class Contacts:
    """Places where bolt and groove could touch, k of them for each of n poses, in G.

    Attributes:
        penetration: (n, k) [m], negative where there is a gap.
        normal: (k, 3) out of the groove, towards the bolt.
        arm: (n, k, 3) from Bo to the place [m].
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
        self._top_rim, self._bottom_rim = rim + top * _UP, rim + bottom * _UP
        across = -_SIDES[:, None] * _ACROSS
        stops = -_SIDES[:, None] * _ALONG
        planes = np.repeat([-_UP, _UP], _RIM_POINTS, axis=0)
        self._normal = np.vstack([across, across, across, stops, planes])

    def contacts(self, R_GB: np.ndarray, p_GBo: np.ndarray) -> Contacts:
        """Returns all places.

        Args:
            R_GB: (n, 3, 3) rotation matrices.
            p_GBo: (n, 3) [m].
        """
        upper, lower, head = np.moveaxis(_moved(self._circles, R_GB, p_GBo), 1, 0)
        groups = [
            self._between(upper, self._neck, self._slot, upper[:, 0] < self._lips_end),
            self._between(lower, self._neck, self._slot, lower[:, 0] < self._lips_end),
            self._between(head, self._head, self._wall, np.ones(len(head), bool)),
            self._stops(head),
            self._planes(R_GB, p_GBo),
        ]
        depth, place = (np.concatenate(part, 1) for part in zip(*groups, strict=True))
        return Contacts(depth, self._normal, place - p_GBo[:, None, :])

    def _between(
        self, centre: np.ndarray, radius: float, wall: float, there: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Returns a circle between two walls at z = -wall and z = wall."""
        gap = radius - wall + _SIDES * centre[:, 2:]
        place = centre[:, None, :] + radius * _SIDES[:, None] * _ACROSS
        return np.where(there[:, None], gap, -1.0), place

    def _stops(self, centre: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Returns the head between both ends of its channel."""
        forward = centre[:, 0] + self._head - self._end
        backward = self._start - (centre[:, 0] - self._head)
        place = centre[:, None, :] + self._head * _SIDES[:, None] * _ALONG
        return np.column_stack([forward, backward]), place

    def _planes(
        self, R_GB: np.ndarray, p_GBo: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Returns the head's rim between floor and lips."""
        top = _moved(self._top_rim, R_GB, p_GBo)
        bottom = _moved(self._bottom_rim, R_GB, p_GBo)
        covered = (top[..., 0] < self._lips_end) & (np.abs(top[..., 2]) > self._slot)
        inside = top[..., 1] < self._under_lip + self._head  # not yet lifted out
        above = np.where(covered & inside, top[..., 1] - self._under_lip, -1.0)
        below = self._floor - bottom[..., 1]
        return np.concatenate([above, below], 1), np.concatenate([top, bottom], 1)


def _moved(points: np.ndarray, R: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Returns points (k, 3) of B in G, (n, k, 3)."""
    return np.einsum("nij,kj->nki", R, points) + p[:, None, :]
