"""The lock as circles and planes, for penalty contact.

The neck is a circle at either edge of the lips, the head a disc in its channel. The
groove's normals are along its axes.
"""

import dataclasses

from drake_disasm.cell.lock_dimensions import groove_boxes, head_top, lip_height
from drake_disasm.common.arrays import Array
from drake_disasm.scenario import LockConfig


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

    @property
    def row(self) -> tuple[float | Array, ...]:
        """Its dimensions as `find_places` has them."""
        return tuple(getattr(self, f.name) for f in dataclasses.fields(self))
