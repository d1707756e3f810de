"""Tables as Parquet and CSV; both keep every bit of a float64."""

import csv
import io
import re
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import IO, Any

import pyarrow as pa  # type: ignore[import-untyped]
import pyarrow.csv as pa_csv  # type: ignore[import-untyped]
import pyarrow.parquet as pq  # type: ignore[import-untyped]
from numpy.typing import NDArray

from drake_disasm.common.errors import DisasmError
from drake_disasm.logs.refusal import refusal

FILE_FORMATS = ("parquet", "csv")

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
        return _csv_names(data)
    try:
        return list(pq.read_schema(_stream(data)).names)
    except (pa.ArrowException, OSError) as error:
        raise _unreadable(path, error, data) from error


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
    try:
        if path.suffix == ".csv":
            table = _read_csv(data, booleans)
        else:
            table = pq.ParquetFile(_stream(data)).read(use_threads=False)
    except (pa.ArrowException, OSError) as error:
        raise _unreadable(path, error, data) from error
    return {name: table[name].to_numpy() for name in table.column_names}


def _csv_names(data: bytes) -> list[str]:
    first = data.partition(b"\n")[0].decode("utf-8-sig", errors="replace")
    rows = csv.reader(io.StringIO(first.rstrip("\r")), skipinitialspace=True)
    return [name.strip() for name in next(rows, [])]


def _read_csv(data: bytes, booleans: Collection[str]) -> pa.Table:
    names = _csv_names(data)
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
    text = str(error).split("\n", 1)[0]
    if path.suffix != ".csv":
        return refusal(path, f"not a whole Parquet file ({text})", "write it again")
    column = re.search(r"column #(\d+)", text)
    if column:
        name = _csv_names(data)[int(column[1])]
        remedy = "write numbers, and true or false for flags, in every row"
        return refusal(path, f"column '{name}': {text}", remedy)
    if "Expected" in text:
        remedy = "give every row one cell per column, separated by commas"
        return refusal(path, f"rows of mixed lengths ({text})", remedy)
    return refusal(path, f"not a table in CSV ({text})", "begin with column names")
