"""The frames in which a log's wrenches may have been written: the sensor's, the log's.

A model's channels are at the sensor. Columns were exchanged in the frame of the table.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drake_disasm.logs import rotation_matrices
from sysid.data_checks.subject import Subject
from sysid.models.base import Array
from sysid.models.twin import TwinModel

_Map = Callable[[Array], Array]


@dataclass(frozen=True)
class Frame:
    """A frame, and the point that torques are about.

    Attributes:
        name: in words; empty where there is no other.
        of: takes the model's channels (n, channels) to it.
        back: from it.
    """

    name: str
    of: _Map
    back: _Map


def frames_of(subject: Subject, rows: NDArray[np.int64]) -> list[Frame]:
    """Returns the frame of the table first, then the model's own, if it is another.

    Args:
        subject: logs and model.
        rows: (n,) those of the model's rows that are turned.
    """
    model = subject.model
    if isinstance(model, TwinModel):
        own = Frame("ft_sensor, in S at So", np.asarray, np.asarray)
        return [Frame("wrench, in G at Bo", model.at_bolt, model.at_sensor), own]
    if any(log.header.frames.get("wrench") == "W" for log in subject.logs):
        own = Frame("in S", np.asarray, np.asarray)
        return [_world(subject, rows), own]
    return [Frame("", np.asarray, np.asarray)]


def _world(subject: Subject, rows: NDArray[np.int64]) -> Frame:
    """Returns the world's frame W, of readings at rest that are written in it."""
    quaternions = np.concatenate([e["R_WS"] for e in subject.episodes])
    R_WS = rotation_matrices(quaternions)[rows]
    R_SW = R_WS.swapaxes(1, 2)
    return Frame("in W", lambda v: _rotated(R_WS, v), lambda v: _rotated(R_SW, v))


def _rotated(R: Array, wrench: Array) -> Array:
    """Returns wrenches (n, 6) turned by (n, 3, 3)."""
    return np.einsum("nij,nkj->nki", R, wrench.reshape(-1, 2, 3)).reshape(-1, 6)
