"""How a log was written, where that would explain it: signs, orders, frames, clocks."""

from dataclasses import dataclass
from typing import Generic, TypeVar

Model = TypeVar("Model", covariant=True)


@dataclass(frozen=True)
class Bookkeeping(Generic[Model]):
    """A way in which a log may have been written otherwise than it says.

    It competes with effects: what explains a log better with fewer parameters is the
    explanation.

    Attributes:
        name: short, like an effect's: `GravityDirection`, `TorqueSign.joint_3`.
        what: a clause, with the value.
        remedy: what to do with the log, or with the map of import-log.
        model: of the log as if it had been written right. Where columns were
            exchanged or turned, its measured values are: rows and channels stay.
        estimated: how many values were estimated from the log, and are fixed in the
            model: an angle, a factor, a delay; signs and orders are none.
    """

    name: str
    what: str
    remedy: str
    model: Model
    estimated: int = 0
