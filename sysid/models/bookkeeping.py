"""How a log was written, where that would explain it: signs, orders, frames, clocks."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Rows = NDArray[np.int64]
Model = TypeVar("Model", covariant=True)


@dataclass(frozen=True)
class Assumption:
    """What a model takes for granted: the logs don't say it, or say otherwise.

    Attributes:
        what: in words, with the reason.
        remedy: what to do.
    """

    what: str
    remedy: str


def _unchanged(channels: Array) -> Array:
    return channels


@dataclass(frozen=True)
class Frame:
    """A frame in which channels may have been written, and where torques are about.

    Attributes:
        name: in words; empty where there is no other.
        of: takes the model's channels (n, channels) to it.
        back: from it.
    """

    name: str = ""
    of: Callable[[Array], Array] = _unchanged
    back: Callable[[Array], Array] = _unchanged


@dataclass(frozen=True)
class Poses:
    """Poses in which rows were read, which tell whether they were read at rest.

    Attributes:
        clock: (rows,) since each log began [s].
        turned: by how much two rows differ (n,), of their numbers (n,) [rad or m].
        R_WS: (rows, 3, 3) of a sensor; None for the joints of an arm.
        at_rest: whether the log says that nothing moves in any row.
    """

    clock: Array
    turned: Callable[[Rows, Rows], Array]
    R_WS: Array | None = None
    at_rest: bool = True


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
