"""The gaps between the bodies of a part, as simple shapes, for IMPACT.

`drake_disasm.twin.equations` finds from them where the bodies touch.
"""

import abc
import dataclasses
from typing import ClassVar, Self

from drake_disasm.common.arrays import Array
from drake_disasm.effects import Environment

#: Numbers of a row, of whatever gaps: `twin.equations` has as many.
GAPS_SIZE = 16


@dataclasses.dataclass(frozen=True)
class Gaps(abc.ABC):
    """Gaps of one kind; a length is a number, or (n,) of n parts.

    Attributes:
        kind: by which `twin.equations` knows what a row is of.
    """

    kind: ClassVar[float]

    @abc.abstractmethod
    def changed_by(self, environment: Environment) -> Self:
        """Returns the gaps in an environment, which effects may have changed."""

    @property
    def row(self) -> tuple[float | Array, ...]:
        """The kind and the dimensions, GAPS_SIZE numbers."""
        own = [getattr(self, f.name) for f in dataclasses.fields(self)]
        return (self.kind, *own, *[0.0] * (GAPS_SIZE - 1 - len(own)))


@dataclasses.dataclass(frozen=True)
class SlotGaps(Gaps):
    """A bolt with neck and head in a slot with a channel under it.

    The neck is a circle at either edge of the lips, the head a disc in its channel,
    whose edge gives when it is tilted. The groove's normals are along its axes.

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

    kind: ClassVar[float] = 0.0

    def changed_by(self, environment: Environment) -> "SlotGaps":
        """See Gaps: the slot's width."""
        return self.with_clearance(environment.clearance)

    def with_clearance(self, clearance: float | Array) -> "SlotGaps":
        """Returns another slot: its width is the neck's diameter and a clearance."""
        return dataclasses.replace(self, slot=self.neck + clearance / 2.0)


@dataclasses.dataclass(frozen=True)
class HoleGaps(Gaps):
    """A peg in a hole, round or square; they touch at the peg's tip and at the mouth.

    Attributes:
        is_square: 1, or 0 of round ones.
        half, hole: half widths of peg and hole [m].
        tip: y of the peg's end in B [m].
        floor: y of the hole's bottom [m].
    """

    is_square: float | Array
    half: float | Array
    hole: float | Array
    tip: float | Array
    floor: float | Array

    kind: ClassVar[float] = 1.0

    def changed_by(self, environment: Environment) -> "HoleGaps":
        """See Gaps: the hole's width."""
        return dataclasses.replace(self, hole=self.half + environment.clearance / 2.0)


@dataclasses.dataclass(frozen=True)
class BayonetGaps(Gaps):
    """A shaft with two lugs under a plate, and the detent's torque.

    Attributes:
        shaft, hole: radii of the shaft and of the plate's hole [m].
        plate: its thickness; its upper face is at y = 0 [m].
        floor: y of the floor under the lugs [m].
        end: radius of the lugs' ends [m].
        half: half width of a lug [m].
        top, bottom: y of the lugs' faces in B [m].
        cosine, sine: of the angle from the start to the notches.
        half_notch, notch_end: half width of the notches, radius of their ends [m].
        stop: from the notches' middle to the stops' faces [m].
        detent, detent_width: greatest torque [N m]; turn at which it lets go [rad].
    """

    shaft: float | Array
    hole: float | Array
    plate: float | Array
    floor: float | Array
    end: float | Array
    half: float | Array
    top: float | Array
    bottom: float | Array
    cosine: float | Array
    sine: float | Array
    half_notch: float | Array
    notch_end: float | Array
    stop: float | Array
    detent: float | Array
    detent_width: float | Array

    kind: ClassVar[float] = 2.0

    def changed_by(self, environment: Environment) -> "BayonetGaps":
        """See Gaps: the hole's width, and the detent."""
        hole = self.shaft + environment.clearance / 2.0
        return dataclasses.replace(self, hole=hole, detent=environment.detent)
