"""The lock as circles and planes, for penalty contact.

The neck is a circle at either edge of the lips, the head a disc in its channel.
Vectorised over poses and over places, in NumPy or torch; the groove's normals are
along its axes.
"""

import dataclasses
import functools

import numpy as np

from drake_disasm.cell.lock_dimensions import groove_boxes, head_top, lip_height
from drake_disasm.common.arrays import (
    Array,
    array_like,
    namespace,
)
from drake_disasm.scenario import LockConfig

_RIM_POINTS = 8
_ANGLES = 2.0 * np.pi * np.arange(_RIM_POINTS) / _RIM_POINTS


def _normals() -> np.ndarray:
    """Returns the normals (k, 3) of all places, out of the groove."""
    across = np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]])
    stops = np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    up = np.array([[0.0, 1.0, 0.0]])
    planes = np.repeat(np.concatenate([-up, up]), _RIM_POINTS, axis=0)
    return np.concatenate([across, across, across, stops, planes])


#: (k, 3) of all places, out of the groove, towards the bolt, in G: along its axes.
NORMALS = _normals()


@dataclasses.dataclass(frozen=True)
class Contacts:
    """Places where bolt and groove could touch, k of them for each of n poses, in G.

    Attributes:
        penetration: (n, k) [m], negative where there is a gap.
        arm: (n, k, 3) from Bo to the place [m].
    """

    penetration: Array
    arm: Array

    @property
    def normal(self) -> np.ndarray:
        """(k, 3) out of the groove, towards the bolt."""
        return NORMALS


@dataclasses.dataclass(frozen=True)
class LockShape:
    """The lock as circles and planes; a length is a number, or (n,) one for each pose.

    Attributes:
        slot, wall: half widths of slot and channel [m].
        lips_end: x where the lips end [m].
        lip, under_lip, floor: y of the lips' faces and of the channel's floor [m].
        start, end: x of the channel's ends [m].
        neck, head: radii [m].
        top, bottom: y of the head's faces in B [m].
    """

    slot: float | Array
    wall: float | Array
    lips_end: float | Array
    lip: float | Array
    under_lip: float | Array
    floor: float | Array
    start: float | Array
    end: float | Array
    neck: float | Array
    head: float | Array
    top: float | Array
    bottom: float | Array

    @classmethod
    def of(cls, lock: LockConfig) -> "LockShape":
        """Returns the shape of a lock's dimensions."""
        boxes = groove_boxes(lock)
        top = head_top(lock)
        return cls(
            slot=float(boxes["lip_left"][0][2]),
            wall=float(boxes["wall_left"][0][2]),
            lips_end=float(boxes["lip_left"][1][0]),
            lip=lip_height(lock),
            under_lip=float(boxes["lip_left"][0][1]),
            floor=float(boxes["floor"][1][1]),
            start=float(boxes["stop_a"][1][0]),
            end=float(boxes["stop_b"][0][0]),
            neck=lock.neck_diameter / 2.0,
            head=lock.head_diameter / 2.0,
            top=top,
            bottom=top - lock.head_thickness,
        )

    def with_clearance(self, clearance: float | Array) -> "LockShape":
        """Returns the shape with another slot: its width less the neck's diameter."""
        return dataclasses.replace(self, slot=self.neck + clearance / 2.0)

    def contacts(self, R_GB: Array, p_GBo: Array) -> Contacts:
        """Returns all places.

        Args:
            R_GB: (n, 3, 3) rotation matrices.
            p_GBo: (n, 3) [m].
        """
        groups = [
            self._neck_between(R_GB, self.lip, p_GBo),
            self._neck_between(R_GB, -self.lip, p_GBo),
            *self._head_between(R_GB, p_GBo),
            *self._planes(R_GB, p_GBo),
        ]
        depth, arm = zip(*groups, strict=True)
        xp = namespace(p_GBo)
        return Contacts(xp.concat(depth, axis=1), xp.concat(arm, axis=1))

    def _neck_between(
        self, R_GB: Array, height: float | Array, p: Array
    ) -> tuple[Array, Array]:
        """Returns the neck's circle at a height between the lips."""
        axis = R_GB[:, :, 1] * _column(height, 1)
        x, z = (p + axis)[:, 0], (p + axis)[:, 2]
        gap, arm = _between(z, axis, self.neck, self.slot, 2)
        xp = namespace(p)
        return xp.where((x < self.lips_end)[:, None], gap, -1.0), arm

    def _head_between(
        self, R_GB: Array, p: Array
    ) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        """Returns the head's disc between the channel's walls, and its ends."""
        middle = (self.top + self.bottom) / 2.0
        axis = R_GB[:, :, 1] * _column(middle, 1)
        centre = p + axis
        walls = _between(centre[:, 2], axis, self.head, self.wall, 2)
        _, arm = _between(centre[:, 0], axis, self.head, self.end, 0)
        forward = centre[:, 0] + self.head - self.end
        backward = self.start - (centre[:, 0] - self.head)
        return walls, (namespace(p).stack([forward, backward], axis=1), arm)

    def _planes(self, R_GB: Array, p: Array) -> list[tuple[Array, Array]]:
        """Returns the head's rim between floor and lips."""
        xp = namespace(p)
        rim = xp.matmul(_rim(R_GB), xp.matrix_transpose(R_GB)) * _column(self.head, 2)
        axis = R_GB[:, None, :, 1]
        top_arm = rim + axis * _column(self.top, 2)
        bottom_arm = rim + axis * _column(self.bottom, 2)
        top, bottom = top_arm + p[:, None, :], bottom_arm + p[:, None, :]
        lips_end, slot = _column(self.lips_end, 1), _column(self.slot, 1)
        covered = (top[..., 0] < lips_end) & (xp.abs(top[..., 2]) > slot)
        edge = _column(self.under_lip + self.head, 1)
        inside = top[..., 1] < edge  # not yet lifted out
        above = top[..., 1] - _column(self.under_lip, 1)
        below = _column(self.floor, 1) - bottom[..., 1]
        return [
            (xp.where(covered & inside, above, -1.0), top_arm),
            (below, bottom_arm),
        ]


def _between(
    place: Array, axis: Array, radius: float | Array, wall: float | Array, along: int
) -> tuple[Array, Array]:
    """Returns a circle between two walls: penetrations (n, 2), arms (n, 2, 3).

    Args:
        place: (n,) of its centre between the walls at -wall and wall.
        axis: (n, 3) of its centre from Bo.
        radius, wall: [m].
        along: number of the axis across the walls.
    """
    xp = namespace(place)
    gap = xp.stack([radius - wall + place, radius - wall - place], axis=1)
    side = _sides(along, axis)[None] * _column(radius, 2)
    return gap, axis[:, None, :] + side


def _column(value: float | Array, axes: int) -> float | Array:
    """Returns a length that is broadcast along further axes."""
    if isinstance(value, float):
        return value
    return value[(slice(None), *[None] * axes)]


@functools.cache
def _side_rows(along: int) -> np.ndarray:
    rows = np.zeros((2, 3))
    rows[:, along] = 1.0, -1.0
    return rows


def _sides(along: int, like: Array) -> Array:
    """Returns both directions (2, 3) along an axis."""
    return array_like(_side_rows(along), like)


def _rim(like: Array) -> Array:
    """Returns points (8, 3) of the unit circle about y."""
    return array_like(_RIM, like)


_RIM = np.column_stack([np.cos(_ANGLES), 0.0 * _ANGLES, np.sin(_ANGLES)])
