"""The lock as circles and planes: the gaps between bolt and groove."""

import dataclasses

from drake_disasm.common.arrays import Array


@dataclasses.dataclass(frozen=True)
class LockShape:
    """The lock as circles and planes; a length is a number, or (n,) of n locks.

    The neck is a circle at either edge of the lips, the head a disc in its channel. The
    groove's normals are along its axes.

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

    def with_clearance(self, clearance: float | Array) -> "LockShape":
        """Returns the shape with another slot: its width less the neck's diameter."""
        return dataclasses.replace(self, slot=self.neck + clearance / 2.0)

    @property
    def row(self) -> tuple[float | Array, ...]:
        """Its dimensions as `twin.equations` has them."""
        return tuple(getattr(self, f.name) for f in dataclasses.fields(self))
