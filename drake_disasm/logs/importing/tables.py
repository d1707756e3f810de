"""Tables: CSV, NPZ, NPY, MATLAB, Parquet and LeRobot datasets."""

import bisect
import codecs
import collections
import csv
import dataclasses
import datetime
import io
import itertools
import json
import operator
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TextIO

import numpy as np
import pyarrow  # type: ignore[import-untyped]
import pyarrow.compute  # type: ignore[import-untyped]
import pyarrow.csv  # type: ignore[import-untyped]
import pyarrow.parquet  # type: ignore[import-untyped]

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import read_text
from drake_disasm.common.text import clipped
from drake_disasm.logs.importing.heads import PEEKED, Head, head_of, names_of
from drake_disasm.logs.importing.matlab import load_mat
from drake_disasm.logs.importing.stream import Stream, flat, readable

_COMMENTS = ("#", "%")
_MOST_META = 2**24  # bytes
_FALLBACK = "cp1252"  # Windows' own where UTF-8 is not said, in western Europe
_FLAGS = {"true": "1", "false": "0"}
_CLOCK = r"\d{1,2}:\d{2}:\d{2}([.,]\d+)?"
_DAY = 86400.0  # s
#: Share of cells that may be no numbers in a column of numbers: as of a log's rows that
#: may be left out.
MOST_TEXT = 0.1


def read_csv(path: Path) -> list[Stream]:
    """Reads a table of numbers with a line of names above it.

    Lines that begin with # or % are comments, but the last one before the rows has
    their names if there are as many. `head_of` tells names, units and lines above them.
    Columns are separated by commas, semicolons, tabs or blanks; without names they are
    column_0, column_1, ... Numbers may have a decimal comma where no comma separates
    them; dates and times become seconds. An empty cell is no number.
    """
    with readable(path), _opened(path) as file:
        rows = _Rows(file)
        first = list(itertools.islice(rows, PEEKED))
        if not first:
            raise DisasmError(f"{path}: has no rows")
        delimiter = _delimiter_of(first)
        split = [_split(line, delimiter) for line in first]
        head = head_of(split, lambda cell: any(is_one(cell) for is_one in _SIGHTS))
        if head.rows == len(first):
            raise DisasmError(f"{path}: has no rows")
        comment = rows.comment_above(head.rows)
        names = head.names or _names_above(comment, delimiter, head.width)
        lines = _Lines(itertools.chain(first[head.rows :], rows), delimiter, len(names))
        texts = _cells(path, lines, delimiter, names)
        columns = [
            _column(each, delimiter != ",", lambda i: rows.line_of(head.rows + i))
            for each in texts
        ]
    notes = [] if file.encoding != _FALLBACK else ["read as Windows-1252: no UTF-8"]
    return streams_of_columns(path, names, columns, head, notes)


def _opened(path: Path) -> TextIO:
    """Opens a text in UTF-16 if its first bytes say so, in UTF-8 or Windows-1252."""
    with path.open("rb") as file:
        is_utf16 = file.read(2) in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
    encoding = "utf-16" if is_utf16 else "utf-8-sig"
    try:
        with path.open(encoding=encoding) as text:
            while text.read(2**20):
                pass
    except UnicodeDecodeError:
        if is_utf16:
            raise
        encoding = _FALLBACK
    return path.open(newline="", encoding=encoding)


@dataclasses.dataclass(frozen=True)
class TableColumn:
    """A table's column.

    Attributes:
        numbers: (n,), NaN where a cell is empty or no number; None if it holds text.
        filled: how many cells are not empty.
        wrong: how many of these are no numbers.
        first: the first of them, and where each is.
    """

    numbers: np.ndarray | None
    filled: int = 0
    wrong: int = 0
    first: tuple[str, ...] = ()

    @property
    def is_text(self) -> bool:
        """Whether too many cells are no numbers."""
        return self.numbers is None or self.wrong > MOST_TEXT * self.filled

    @property
    def reason(self) -> str:
        """Why it is no channel."""
        if self.wrong == self.filled:
            return "holds text"
        return (
            f"holds text in {self.wrong} of {self.filled} cells, such as "
            f"{self.first[0]}"
        )

    @property
    def wrong_words(self) -> str:
        """What it has that is no number."""
        is_are = "is no number" if self.wrong == 1 else "are no numbers"
        cells = ", ".join(self.first) + (", ..." if self.wrong > 3 else "")
        return f"{_counted(self.wrong, 'cell')} {is_are}: {cells}"


def streams_of_columns(
    path: Path,
    names: Sequence[str],
    columns: Sequence[TableColumn],
    head: Head,
    notes: Sequence[str] = (),
) -> list[Stream]:
    """Returns a table's columns, without those that hold text or share a name.

    Args:
        path: for messages.
        names: of the columns.
        columns: as many.
        head: what stands above them.
        notes: what else was noticed.
    """
    pairs = [
        (name, column)
        for i, (name, column) in enumerate(zip(names, columns, strict=True))
        if column.filled or not head.names or name != f"column_{i}"
    ]
    count = collections.Counter(name for name, _ in pairs)
    out = {name: column.reason for name, column in pairs if column.is_text}
    out |= {n: f"names {k} columns: rename one" for n, k in count.items() if k > 1}
    kept = {n: c for n, c in pairs if n not in out and c.numbers is not None}
    said = list(notes)
    if head.skipped:
        said.append(f"{_counted(head.skipped, 'line')} above the table skipped")
    said += [f"{clipped(n)}: {c.wrong_words}" for n, c in kept.items() if c.wrong]
    streams = _tables(path, {n: c.numbers for n, c in kept.items()}, out)
    labels = {n: label for n, label in head.labels.items() if n in kept}
    first = dataclasses.replace(streams[0], labels=labels, notes=tuple(said))
    return [first, *streams[1:]]


def _counted(count: int, what: str) -> str:
    return f"{count} {what}{'s' if count > 1 else ''}"


class _Rows(Iterator[str]):
    """The lines of a table that hold cells."""

    def __init__(self, lines: Iterable[str]) -> None:
        self._lines, self._count = enumerate(lines, 1), 0
        self._offsets = [(-1, 1)]  # of lines from rows, from a row on
        self._comments = dict[int, str]()

    def __next__(self) -> str:
        """Returns the next one."""
        for number, line in self._lines:
            text = line.strip()
            if not text.startswith(_COMMENTS):
                if not text:
                    continue
                if number - self._count != self._offsets[-1][1]:
                    self._offsets.append((self._count, number - self._count))
                self._count += 1
                return line
            comment = text.lstrip("".join(_COMMENTS)).strip()
            self._comments[self._count] = comment
        raise StopIteration

    def line_of(self, row: int) -> int:
        """Returns the number of a row's line in the file."""
        last = bisect.bisect_right(self._offsets, row, key=operator.itemgetter(0)) - 1
        return row + self._offsets[last][1]

    def comment_above(self, row: int) -> str:
        """Returns the last comment above a row, without its sign; "" for none."""
        above = [number for number in self._comments if number <= row]
        return self._comments[max(above)] if above else ""


def _delimiter_of(lines: Sequence[str]) -> str:
    """Returns what separates the cells of lines, so that most of them have as many.

    Of several such, what leaves most numbers: a comma beside semicolons is decimal, a
    blank beside commas is in a name.
    """
    scores = dict[str, tuple[int, int]]()
    for delimiter in ";\t, ":
        split = [_split(line, delimiter) for line in lines]
        count = collections.Counter(map(len, split))
        width = max(count, key=lambda n: (count[n], n))
        table = [cells for cells in split if len(cells) == width > 1]
        numbers = sum(_is_number(cell) for cells in table for cell in cells)
        scores[delimiter] = len(table), numbers
    best = max(scores, key=lambda delimiter: scores[delimiter])
    return best if scores[best][0] else " "


def _split(line: str, delimiter: str) -> list[str]:
    line = line.strip(None if delimiter != "\t" else " \r\n")
    cells = next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), [""])
    return [cell.strip() for cell in cells]


def _names_above(comment: str, delimiter: str, count: int) -> tuple[str, ...]:
    """Returns the names of columns that a comment above them has, or their numbers."""
    names = _split(comment, delimiter) if comment else []
    if len(names) == count and not any(map(_is_number, names)):
        return tuple(names)
    return names_of([""] * count)


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
) -> list[pyarrow.ChunkedArray]:
    """Returns the cells of a table's columns, as text; "" is null."""
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
            f"table {len(names)} columns; correct it"
        ) from None
    return list(table.columns)


def _is_number(cell: str) -> bool:
    try:
        float(cell.replace(",", ".") if cell[-1:] != "," else cell)
    except ValueError:
        return cell.lower() in _FLAGS
    return True


def _is_date(cell: str) -> bool:
    try:
        datetime.datetime.fromisoformat(cell)
    except ValueError:
        return False
    return True


def _is_clock(cell: str) -> bool:
    return re.fullmatch(_CLOCK, cell) is not None


#: What tells that a cell is a number or a time.
_SIGHTS: tuple[Callable[[str], bool], ...] = (_is_number, _is_date, _is_clock)


def _column(
    cells: pyarrow.ChunkedArray, may_have_comma: bool, line_of: Callable[[int], int]
) -> TableColumn:
    """Returns the numbers that cells of text say, of a column of which most do.

    Args:
        cells: of a column.
        may_have_comma: whether a comma may be decimal.
        line_of: the line of each, by its row.
    """
    trimmed = pyarrow.compute.utf8_trim_whitespace(cells)
    filled = len(trimmed) - trimmed.null_count
    numbers = _numbers(trimmed, may_have_comma)
    if numbers is not None:
        return TableColumn(numbers, filled)
    texts = trimmed.to_pylist()
    ways = (
        [i for i, x in enumerate(texts) if x and not is_one(x)] for is_one in _SIGHTS
    )
    wrong = min(ways, key=len)
    first = tuple(f"'{clipped(texts[i])}' in line {line_of(i)}" for i in wrong[:3])
    if len(wrong) <= MOST_TEXT * filled:
        for i in wrong:
            texts[i] = None
        numbers = _numbers(pyarrow.chunked_array([texts]), may_have_comma)
    if numbers is None and not wrong:
        return TableColumn(None, filled, filled)  # in several ways
    return TableColumn(numbers, filled, len(wrong), first)


def _numbers(cells: pyarrow.ChunkedArray, may_have_comma: bool) -> np.ndarray | None:
    """Returns the numbers that all cells say, NaN for null; None if they don't."""
    ways = (_plain_numbers, *([_decimal_commas] if may_have_comma else []))
    for way in (*ways, _times, _clocks):
        try:
            return way(cells)
        except pyarrow.ArrowInvalid:
            continue
    # PyArrow has no flags, and fewer ways to write a number than Python.
    texts = (cell or "nan" for cell in cells.to_pylist())
    try:
        return np.array([float(_FLAGS.get(text.lower(), text)) for text in texts])
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


def _clocks(cells: pyarrow.ChunkedArray) -> np.ndarray:
    """Returns seconds since the first midnight of times of day."""
    compute = pyarrow.compute
    padded = compute.replace_substring_regex(cells, r"^(\d):", r"0\1:")
    dated = compute.binary_join_element_wise("1970-01-01", padded, " ")
    return past_midnight(_times(compute.replace_substring(dated, ",", ".")))


def past_midnight(times: np.ndarray) -> np.ndarray:
    """Returns times of day (n,) [s] that go on at midnight: back by half a day or more
    is the next day."""
    whole = np.flatnonzero(np.isfinite(times))
    days = np.cumsum(np.diff(times[whole], prepend=np.nan) < -0.5 * _DAY)
    times = times.copy()
    times[whole] += _DAY * days
    return times


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
    clocks = {a.size for a in rest.values() if _increases(a)}
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


def _increases(array: np.ndarray) -> bool:
    """Whether an array is a vector of numbers that increase, as times do."""
    is_vector = max(array.shape) == array.size
    return is_vector and bool((np.diff(array.ravel().astype(float)) > 0.0).all())
