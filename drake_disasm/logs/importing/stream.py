"""Channels that share a clock, and what reading them from a damaged file ends with."""

import dataclasses
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.text import clipped

Array = NDArray[np.float64]

#: A larger value is damage: its square times another's would overflow.
LARGEST = 1e50
#: Share of the median period: rows that are closer can't tell a slope.
CLOSEST = 0.01


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
        labels: what metadata call a channel, where that is not its name.
        left_out: why a part of the recording is no channel, by its name.
        sequence: (n,) numbers of a topic's messages, of which some may be lost.
        notes: what its reader took for granted, or could not read.
    """

    name: str
    channels: Mapping[str, Array]
    time: Array | None = None
    received: Array | None = None
    kind: str = ""
    constants: Mapping[str, float] = dataclasses.field(default_factory=dict)
    labels: Mapping[str, str] = dataclasses.field(default_factory=dict)
    left_out: Mapping[str, str] = dataclasses.field(default_factory=dict)
    sequence: Array | None = None
    notes: tuple[str, ...] = ()

    @property
    def names(self) -> list[str]:
        """Of its channels."""
        return list(self.channels)

    @property
    def is_unnamed(self) -> bool:
        """Whether it is a table without names: its columns are numbered."""
        numbers = [f"column_{i}" for i in range(len(self.names) + len(self.left_out))]
        return not self.name and {*self.names, *self.left_out} == {*numbers}

    @property
    def rows(self) -> int:
        """How many rows it has."""
        return len(next(iter(self.channels.values()), ()))


def flat(arrays: Mapping[str, np.ndarray]) -> dict[str, Array]:
    """Returns (n,) channels of arrays (n,) and (n, k), as name, name.0, name.1."""
    found = dict[str, Array]()
    for name, values in arrays.items():
        columns = np.asarray(values, dtype=np.float64)
        if columns.ndim == 1:
            found[name] = columns
            continue
        if columns.shape[1] == 1:
            found[name] = columns[:, 0]
            continue
        found |= {f"{name}.{i}": columns[:, i] for i in range(columns.shape[1])}
    return found


@contextmanager
def readable(path: Path) -> Iterator[None]:
    """Makes what a library raises of a damaged file one line.

    Of damage it may be anything: NumPy tokenises a header as Python, SciPy lets zlib's
    errors through, a length of 2^60 bytes in an MCAP file is a MemoryError.

    Args:
        path: of the file.

    Raises:
        DisasmError: whatever went wrong.
    """
    try:
        yield
    except DisasmError:
        raise
    except Exception as error:
        what = clipped(str(error)) or type(error).__name__
        raise DisasmError(f"{path}: can't be read: {what}") from None
