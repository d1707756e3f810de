"""Tables: CSV, NPZ, NPY, MATLAB, Parquet and LeRobot datasets."""

import collections
import csv
import dataclasses
import io
import itertools
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow  # type: ignore[import-untyped]
import pyarrow.compute  # type: ignore[import-untyped]
import pyarrow.csv  # type: ignore[import-untyped]
import pyarrow.parquet  # type: ignore[import-untyped]

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import read_text
from drake_disasm.common.text import clipped
from drake_disasm.importing.matlab import load_mat
from drake_disasm.importing.stream import Stream, flat, readable

_COMMENTS = ("#", "%")
_MOST_META = 2**24  # bytes


def read_csv(path: Path) -> list[Stream]:
    """Reads a table of numbers with a line of names above it.

    Lines that begin with # or % are comments, but the last one before the rows has
    their names if there are as many. Columns are separated by commas, semicolons, tabs
    or blanks; without names they are column_0, column_1, ... Numbers may have a decimal
    comma where no comma separates them; dates and times become seconds since 1970. A
    column of anything else is left out; an empty cell is no number.
    """
    with readable(path), path.open(newline="", encoding="utf-8-sig") as file:
        rows = _Rows(file)
        first = next(rows, "")
        delimiter = _delimiter_of(first)
        names = _split(first, delimiter)
        if all(_is_number(cell) for cell in names):
            names, second = _names_above(rows.comment, delimiter, len(names)), first
        else:
            second = next(rows, "")
        if not second:
            raise DisasmError(f"{path}: has no rows")
        lines = _Lines(itertools.chain([second], rows), delimiter, len(names))
        columns = _cells(path, lines, delimiter, names)
        numbers = [_numbers(column, delimiter != ",") for _, column in columns]
    return streams_of_columns(path, names, numbers)


def streams_of_columns(
    path: Path, names: Sequence[str], columns: Sequence[np.ndarray | None]
) -> list[Stream]:
    """Returns a table's columns (n,), without those that are None: they hold text."""
    count = collections.Counter(names)
    cells = list(zip(names, columns, strict=True))
    out = {n: "holds text" for n, found in cells if found is None}
    out |= {n: f"names {k} columns: rename one" for n, k in count.items() if k > 1}
    arrays = {n: found for n, found in cells if found is not None and n not in out}
    return _tables(path, arrays, out)


class _Rows(Iterator[str]):
    """The lines of a table that hold cells.

    Attributes:
        comment: the latest, without its sign.
    """

    def __init__(self, lines: Iterable[str]) -> None:
        self._lines, self.comment = iter(lines), ""

    def __next__(self) -> str:
        """Returns the next one."""
        for line in self._lines:
            text = line.strip()
            if not text.startswith(_COMMENTS):
                if text:
                    return line
                continue
            self.comment = text.lstrip("".join(_COMMENTS)).strip()
        raise StopIteration


def _delimiter_of(line: str) -> str:
    """Returns what separates a line's cells.

    A comma beside semicolons is decimal; a blank beside commas or tabs is in a name.
    """
    if ";" in line:
        return ";"
    likely = max(",\t", key=line.strip().count)
    return likely if likely in line.strip() else " "


def _split(line: str, delimiter: str) -> list[str]:
    cells = next(csv.reader([line], delimiter=delimiter, skipinitialspace=True))
    return [cell.strip() for cell in cells]


def _names_above(comment: str, delimiter: str, count: int) -> list[str]:
    """Returns the names of columns that a comment above them has, or their numbers."""
    names = _split(comment, delimiter) if comment else []
    if len(names) == count and not any(map(_is_number, names)):
        return names
    return [f"column_{i}" for i in range(count)]


class _Lines(io.RawIOBase):
    """A file of the lines of a table, for PyArrow.

    Args:
        lines: of the rows.
        delimiter: of their cells; of blanks, several are one.
        count: of the columns; an empty cell after the last one is none.
    """

    def __init__(self, lines: Iterator[str], delimiter: str, count: int) -> None:
        self._lines, self._delimiter, self._count = lines, delimiter, count
        self._left = bytearray()

    def readable(self) -> bool:
        """See RawIOBase."""
        return True

    def readinto(self, buffer: Any) -> int:
        """See RawIOBase."""
        while len(self._left) < len(buffer) and (line := next(self._lines, "")):
            self._left += self._plain(line).encode()
        count = min(len(buffer), len(self._left))
        buffer[:count] = self._left[:count]
        del self._left[:count]
        return count

    def _plain(self, line: str) -> str:
        """Returns a line with one delimiter between its cells and none at its end."""
        line = line.strip(None if self._delimiter != "\t" else " \r\n")
        if self._delimiter == " ":
            line = " ".join(line.split())
        ends = line.endswith(self._delimiter)
        if ends and line.count(self._delimiter) == self._count:
            line = line[:-1]
        return line + "\n"


def _cells(
    path: Path, lines: _Lines, delimiter: str, names: Sequence[str]
) -> list[tuple[str, pyarrow.ChunkedArray]]:
    """Returns the names and the cells of a table's columns, as text; "" is null."""
    wrong: list[Any] = []

    def refuse(row: Any) -> str:
        """Has PyArrow stop at a row that is too long or too short."""
        wrong.append(row)
        return "error"

    unique = [str(i) for i in range(len(names))]  # names may be there twice
    try:
        table = pyarrow.csv.read_csv(
            pyarrow.PythonFile(lines, mode="r"),
            pyarrow.csv.ReadOptions(use_threads=False, column_names=unique),
            pyarrow.csv.ParseOptions(delimiter=delimiter, invalid_row_handler=refuse),
            pyarrow.csv.ConvertOptions(
                column_types=dict.fromkeys(unique, pyarrow.string()),
                strings_can_be_null=True,
                null_values=[""],
            ),
        )
    except pyarrow.ArrowException:
        if not wrong:
            raise
        raise DisasmError(
            f"{path}: row {wrong[0].number} has {wrong[0].actual_columns} cells, the "
            f"first line {len(names)}; correct it"
        ) from None
    return list(zip(names, table.columns, strict=True))


def _is_number(cell: str) -> bool:
    try:
        float(cell.replace(",", "."))
    except ValueError:
        return False
    return True


def _numbers(cells: pyarrow.ChunkedArray, may_have_comma: bool) -> np.ndarray | None:
    """Returns the numbers that cells of text say, NaN for null; None if they don't.

    Args:
        cells: of a column.
        may_have_comma: whether a comma may be decimal.
    """
    trimmed = pyarrow.compute.utf8_trim_whitespace(cells)
    ways = (_plain_numbers, *([_decimal_commas] if may_have_comma else []))
    for way in (*ways, _times):
        try:
            return way(trimmed)
        except pyarrow.ArrowInvalid:
            continue
    # PyArrow has no flags, and fewer ways to write a number than Python.
    flags = {"true": "1", "false": "0", "": "nan"}
    texts = (cell or "" for cell in trimmed.to_pylist())
    try:
        return np.array([float(flags.get(text.lower(), text)) for text in texts])
    except ValueError:
        return None


def _plain_numbers(cells: pyarrow.ChunkedArray) -> np.ndarray:
    return np.asarray(cells.cast(pyarrow.float64()).to_numpy())


def _decimal_commas(cells: pyarrow.ChunkedArray) -> np.ndarray:
    return _plain_numbers(pyarrow.compute.replace_substring(cells, ",", "."))


def _times(cells: pyarrow.ChunkedArray) -> np.ndarray:
    """Returns seconds since 1970 (UTC, where no zone is said) of dates and times."""
    try:
        found = cells.cast(pyarrow.timestamp("ns"))
    except pyarrow.ArrowInvalid:
        found = cells.cast(pyarrow.timestamp("ns", "UTC"))
    seconds = found.cast(pyarrow.int64()).cast(pyarrow.float64(), safe=False)
    return 1e-9 * np.asarray(seconds.to_numpy())


def read_npz(path: Path) -> list[Stream]:
    """Reads NumPy's archive of arrays."""
    with readable(path), np.load(path, allow_pickle=False) as file:
        return _tables(path, {name: file[name] for name in file.files})


def read_npy(path: Path) -> list[Stream]:
    """Reads one array (n, k): columns column.0, column.1, ... or a record array's."""
    with readable(path):
        array = np.load(path, allow_pickle=False)
        names = array.dtype.names
        found = {n: array[n] for n in names} if names else {"column": array}
        return _tables(path, found)


def read_mat(path: Path) -> list[Stream]:
    """Reads a MATLAB file of version 7 or older; a struct's members are struct.name."""
    with readable(path):
        return _tables(path, load_mat(path))


def read_parquet(path: Path) -> list[Stream]:
    """Reads a Parquet table; columns of lists are name.0, name.1, ..."""
    with readable(path):
        return _tables(path, *_columns(pyarrow.parquet.read_table(path)))


def read_lerobot(path: Path) -> list[Stream]:
    """Reads the Parquet files of a LeRobot dataset, episodes one after the other."""
    with readable(path):
        files = sorted((path / "data").rglob("*.parquet"))
        if not files:
            raise DisasmError(f"{path}: has no data/**/*.parquet")
        tables = [pyarrow.parquet.read_table(file) for file in files]
        joined = pyarrow.concat_tables(tables, promote_options="default")
        labels, videos = _features(path / "meta/info.json")
        columns, out = _columns(joined)
        streams = _tables(path, columns, videos | out)
    known = {n: label for n, label in labels.items() if n in streams[0].channels}
    return [dataclasses.replace(streams[0], labels=known), *streams[1:]]


def _features(path: Path) -> tuple[dict[str, str], dict[str, str]]:
    """Returns the channels' names that LeRobot's metadata state, and what is video.

    Names are a list, or a list behind a key such as "motors".
    """
    info = json.loads(read_text(path, "give the whole dataset", _MOST_META))
    features = info.get("features", {}) if isinstance(info, dict) else {}
    labels, videos = dict[str, str](), dict[str, str]()
    for feature, known in features.items() if isinstance(features, dict) else ():
        if not isinstance(known, dict):
            continue
        if known.get("dtype") in ("video", "image"):
            videos[feature] = f"is {known['dtype']}"
            continue
        names = known.get("names")
        if isinstance(names, dict) and len(names) == 1:
            names = next(iter(names.values()))
        names = names if isinstance(names, list) else []
        for i, name in enumerate(names):
            channel = f"{feature}.{i}" if len(names) > 1 else feature
            labels[channel] = f"{feature}.{name}"
    return labels, videos


def _columns(table: pyarrow.Table) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """Returns a table's columns, and what is left out of it."""
    found, out = dict[str, np.ndarray](), dict[str, str]()
    for name in table.column_names:
        kind = table.schema.field(name).type
        if pyarrow.types.is_list(kind) or pyarrow.types.is_fixed_size_list(kind):
            rows = table[name].to_pylist()
            if len({-1 if row is None else len(row) for row in rows}) == 1:
                found[name] = np.array(rows)
            else:
                out[name] = "holds lists of several lengths"
        else:
            found[name] = table[name].to_numpy()
    return found, out


def _seconds(array: np.ndarray) -> np.ndarray:
    """Returns times since 1970, and durations, in seconds; others as they are."""
    if array.dtype.kind not in "mM":
        return array
    unit = "timedelta64[ns]" if array.dtype.kind == "m" else "datetime64[ns]"
    numbers = 1e-9 * array.astype(unit).astype(np.int64)
    return np.where(np.isnat(array), np.nan, numbers)


def _tables(
    path: Path, arrays: Mapping[str, Any], left_out: Mapping[str, str] | None = None
) -> list[Stream]:
    """Returns a stream for each length of arrays, the longest first.

    Single numbers are constants. Arrays of three dimensions are left out: whether they
    are episodes, images or matrices their shape doesn't say.

    Args:
        path: for messages.
        arrays: of anything.
        left_out: what is no array, with the reason.
    """
    given = {name: _seconds(np.asarray(array)) for name, array in arrays.items()}
    out = dict(left_out or {}) | {n: w for n, a in given.items() if (w := _unfit(a))}
    numbers = {n: a for n, a in given.items() if n not in out}
    constants = {n: float(a.ravel()[0]) for n, a in numbers.items() if a.size == 1}
    rest = {n: a for n, a in numbers.items() if n not in constants}
    if not rest:
        raise DisasmError(f"{path}: has no columns of numbers{_reasons(out)}")
    clocks = {a.size for a in rest.values() if _is_clock(a)}
    by_rows = dict[int, dict[str, np.ndarray]]()
    for name, array in rest.items():
        axis = int(np.argmax(array.shape))
        for i, size in enumerate(array.shape):
            axis = i if size in clocks and array.shape[axis] not in clocks else axis
        # MATLAB may hold rows where we have columns.
        table = by_rows.setdefault(array.shape[axis], {})
        table[name] = array.T if axis else array
    lengths = sorted(by_rows, reverse=True)
    streams = [Stream("", flat(by_rows[n]), constants=constants) for n in lengths]
    return [dataclasses.replace(streams[0], left_out=out), *streams[1:]]


def _reasons(out: Mapping[str, str]) -> str:
    first = "; ".join(f"{clipped(name)} {why}" for name, why in list(out.items())[:3])
    return f": {first}" if first else ""


def _unfit(array: np.ndarray) -> str:
    """Returns why an array is no channels; "" if it is."""
    if array.dtype.kind not in "fiub":
        return "holds no real numbers"
    if not array.size:
        return "is empty"
    if sum(size > 1 for size in array.shape) > 2 or array.ndim > 2:
        shape = " x ".join(map(str, array.shape))
        return (
            f"has {array.ndim} dimensions, {shape}: which is which? save it as arrays "
            "of rows and columns, episodes one after the other"
        )
    return ""


def _is_clock(array: np.ndarray) -> bool:
    """Whether an array is a vector of numbers that increase, as times do."""
    is_vector = max(array.shape) == array.size
    return is_vector and bool((np.diff(array.ravel().astype(float)) > 0.0).all())
