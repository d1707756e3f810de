"""Channels that share a clock."""

import dataclasses
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class Stream:
    """A table, or a topic of a bag.

    Attributes:
        name: of the topic; "" for a table.
        channels: (n,) values by name; of a topic "topic:field".
        time: (n,) stamps that the messages carry [s]; None for a table, one of whose
            channels is the time.
        received: (n,) when the recorder received them [s]; None for a table.
        kind: message type of a topic.
        constants: single numbers that stand beside a table, such as a gain.
    """

    name: str
    channels: Mapping[str, Array]
    time: Array | None = None
    received: Array | None = None
    kind: str = ""
    constants: Mapping[str, float] = dataclasses.field(default_factory=dict)

    @property
    def names(self) -> list[str]:
        """Of its channels."""
        return list(self.channels)

    @property
    def rows(self) -> int:
        """How many rows it has."""
        return len(next(iter(self.channels.values()), ()))


def flat(arrays: Mapping[str, np.ndarray]) -> dict[str, Array]:
    """Returns (n,) channels of arrays (n,) and (n, k, ...), as name, name.0, name.1."""
    found = dict[str, Array]()
    for name, values in arrays.items():
        array = np.asarray(values, dtype=np.float64)
        if array.ndim == 1:
            found[name] = array
            continue
        columns = array.reshape(len(array), -1)
        if columns.shape[1] == 1:
            found[name] = columns[:, 0]
            continue
        found |= {f"{name}.{i}": columns[:, i] for i in range(columns.shape[1])}
    return found
