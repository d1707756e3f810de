"""The rows of an episode on the disk as they come, until it is whole.

They are lines of CSV in a hidden file. An action and its rewards are known at the end
of their step, together with the next row's measurements, and stand in that row's line;
reading moves them up to where the format has them.
"""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.file_lock import lock, try_lock
from drake_disasm.common.files import read_bytes
from drake_disasm.logs.columns import columns_of
from drake_disasm.logs.refusal import refusal
from drake_disasm.logs.schema import Kind
from drake_disasm.logs.tables import MOST_BYTES, read_table


class RowFile:
    """A file of rows, locked for as long as they come.

    A row is with the system once it is appended: it survives the program, however that
    ends. It is not forced to the disk, which takes up to 12 ms here, where a robot is
    waiting; so a machine that fails may lose the rows of its last seconds.
    """

    def __init__(self, path: Path, names: Sequence[str]) -> None:
        """Makes the file.

        Args:
            path: that is not there yet.
            names: of the columns.

        Raises:
            DisasmError: it is there, or can't be written.
        """
        self._path, self._names = path, tuple(names)
        try:
            self._stream = path.open("xb", buffering=0)
        except FileExistsError:
            raise refusal(
                path, "is written by another program", "name a folder for each"
            ) from None
        except OSError as error:
            raise self._unwritable(error) from error
        lock(self._stream)  # a reader may look, for a moment, whether it is
        self._write(",".join(self._names))

    def append(self, row: Mapping[str, Any]) -> None:
        """Writes a row: a number, or a truth value, for each column.

        Raises:
            DisasmError: it can't be written; then half of it may be there.
        """
        self._write(",".join(_cell(row[name]) for name in self._names))

    def close(self) -> None:
        """Ends the writing; the file stays."""
        self._stream.close()

    def _write(self, line: str) -> None:
        data = f"{line}\n".encode()
        try:
            if self._stream.write(data) != len(data):
                raise OSError(0, "half a row was written")
        except OSError as error:
            raise self._unwritable(error) from error

    def _unwritable(self, error: OSError) -> DisasmError:
        return refusal(
            self._path,
            f"cannot be written ({error.strerror})",
            "check the disk's space and the folder's permissions",
        )


def read_rows(path: Path, kind: Kind) -> dict[str, NDArray[Any]]:
    """The whole rows of a file, up to the first that was not measured whole.

    Args:
        path: that a RowFile wrote; half a line at its end is left out.
        kind: of the log.

    Returns:
        The columns, as long as each other; {} if there is no row. In the last row
        the columns of a step are zero.

    Raises:
        DisasmError: it can't be read, or is damaged.
    """
    data = read_bytes(path, "remove it", MOST_BYTES).partition(b"\0")[0]
    whole = data.rpartition(b"\n")[0]
    if b"\n" not in whole:
        return {}
    table = read_table(whole, path, kind.boolean_columns)
    floats = [v for name, v in table.items() if name not in kind.boolean_columns]
    if not floats:
        raise refusal(path, "no column of numbers", "remove it")
    finite = np.isfinite(np.column_stack(floats)).all(axis=1)
    rows = int(np.argmin(np.append(finite, False)))
    steps = {n for q in kind.quantities if q.of_step for n in columns_of(q, table)}
    return {
        name: _moved_up(values[:rows]) if name in steps else values[:rows]
        for name, values in table.items()
    }


def is_being_written(path: Path) -> bool:
    """Whether a program has a file of rows open."""
    try:
        with open(os.open(path, os.O_RDONLY | os.O_NONBLOCK), "rb") as file:
            return not try_lock(file)
    except OSError:  # it was finished meanwhile
        return False


def _moved_up(values: NDArray[Any]) -> NDArray[Any]:
    """Returns the values of the steps in the rows that they began in; the last 0."""
    return np.append(values[1:], np.zeros(min(1, len(values))))


def _cell(value: Any) -> str:
    is_flag = isinstance(value, bool | np.bool_)
    return str(bool(value)).lower() if is_flag else repr(float(value))
