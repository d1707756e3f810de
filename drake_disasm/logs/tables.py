"""Tables as Parquet and CSV; both keep every bit of a float64."""

import contextlib
import csv
import io
import re
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import IO, Any

import pyarrow as pa  # type: ignore[import-untyped]
import pyarrow.csv as pa_csv  # type: ignore[import-untyped]
import pyarrow.parquet as pq  # type: ignore[import-untyped]
from numpy.typing import NDArray

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.text import clipped
from drake_disasm.logs.refusal import refusal
from drake_disasm.logs.schema import MOST_CELLS

FILE_FORMATS = ("parquet", "csv")
MOST_BYTES = 2**30  # of an episode's file
_LONGEST_LINE = 2**20  # bytes, of a CSV's column names

# PyArrow strips blanks before numbers but not before these.
_TRUE = [blank + word for blank in ("", " ") for word in ("true", "True", "TRUE", "1")]
_FALSE = [
    blank + word for blank in ("", " ") for word in ("false", "False", "FALSE", "0")
]


def write_table(
    columns: Mapping[str, NDArray[Any]], file_format: str, stream: IO[bytes]
) -> None:
    """Writes columns of equal length as a table in one of `FILE_FORMATS`."""
    table = pa.table(dict(columns))
    if file_format == "csv":
        pa_csv.write_csv(table, stream)
    else:
        pq.write_table(table, stream, use_dictionary=False)


def column_names(data: bytes, path: Path) -> list[str]:
    """The names of a table's columns.

    Args:
        data: the content of the file.
        path: its name; the suffix tells the format.

    Raises:
        DisasmError: the content is not of that format.
    """
    if path.suffix == ".csv":
        return _csv_names(data, path)
    with _named(path, data):
        return list(pq.read_schema(_stream(data)).names)


def read_table(
    data: bytes, path: Path, booleans: Collection[str]
) -> dict[str, NDArray[Any]]:
    """The columns of a table, by name.

    Args:
        data: the content of the file.
        path: its name; the suffix tells the format.
        booleans: names of the columns that hold true or false; in a CSV all others
            are read as float64.

    Raises:
        DisasmError: the content is not of that format, a cell of a CSV is not a
            number, or its rows have mixed lengths.
    """
    with _named(path, data):
        is_csv = path.suffix == ".csv"
        table = _read_csv(data, path, booleans) if is_csv else _read_parquet(data, path)
        if len(set(table.column_names)) < len(table.column_names):
            raise refusal(path, "columns of one name", "rename one of them")
        return {name: table[name].to_numpy() for name in table.column_names}


@contextlib.contextmanager
def _named(path: Path, data: bytes) -> Iterator[None]:
    """Makes refusals that name the file of what PyArrow raises."""
    try:
        yield
    except DisasmError:
        raise
    except Exception as error:  # mostly its own, but UnicodeDecodeError for a name
        raise _unreadable(path, error, data) from error


def _csv_names(data: bytes, path: Path) -> list[str]:
    line = data[:_LONGEST_LINE].partition(b"\n")[0]
    first = line.decode("utf-8-sig", errors="replace").rstrip("\r")
    rows = csv.reader(io.StringIO(first), skipinitialspace=True)
    try:
        if len(line) == _LONGEST_LINE:
            raise csv.Error("the first line has no end")
        return [name.strip() for name in next(rows, [])]
    except csv.Error as error:
        raise refusal(
            path, f"not a table in CSV ({error})", "begin with column names"
        ) from None


def _read_parquet(data: bytes, path: Path) -> pa.Table:
    file = pq.ParquetFile(_stream(data))
    for field in file.schema_arrow:
        if not pa.types.is_primitive(field.type):
            raise refusal(
                path,
                f"column '{clipped(field.name)}' is of type {clipped(str(field.type))}",
                "write a number in every row, and true or false for flags",
            )
    cells = file.metadata.num_rows * len(file.schema_arrow)
    if cells > MOST_CELLS:
        raise refusal(path, f"{cells} values", f"split it: {MOST_CELLS} at most")
    return file.read(use_threads=False)


def _read_csv(data: bytes, path: Path, booleans: Collection[str]) -> pa.Table:
    names = _csv_names(data, path)
    types = {name: pa.bool_() if name in booleans else pa.float64() for name in names}
    body = data.partition(b"\n")[2]
    if not body.strip():
        return pa.schema(list(types.items())).empty_table()
    return pa_csv.read_csv(
        _stream(body),
        read_options=pa_csv.ReadOptions(column_names=names, use_threads=False),
        convert_options=pa_csv.ConvertOptions(
            column_types=types, true_values=_TRUE, false_values=_FALSE
        ),
    )


def _stream(data: bytes) -> pa.BufferReader:
    """Returns what PyArrow reads the bytes from: a copy in memory of its own.

    One of PyArrow's threads may let go of the memory when the table has long been
    returned. If it were Python's, that needs the interpreter; where the interpreter
    is ending just then, the process aborts ("terminate called ...").
    """
    owned = pa.BufferOutputStream()
    owned.write(data)
    return pa.BufferReader(owned.getvalue())


def _unreadable(path: Path, error: Exception, data: bytes) -> DisasmError:
    text = clipped(str(error).split("\n", 1)[0], 200)
    if path.suffix != ".csv":
        return refusal(path, f"not a whole Parquet file ({text})", "write it again")
    column = re.search(r"column #(\d+)", text)
    if column:
        name = _csv_names(data, path)[int(column[1])]
        remedy = "write numbers, and true or false for flags, in every row"
        return refusal(path, f"column '{name}': {text}", remedy)
    if "Expected" in text:
        remedy = "give every row one cell per column, separated by commas"
        return refusal(path, f"rows of mixed lengths ({text})", remedy)
    return refusal(path, f"not a table in CSV ({text})", "begin with column names")
