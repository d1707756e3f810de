"""Sheets of Excel's workbooks (.xlsx), read by openpyxl."""

import contextlib
import datetime
import itertools
import math
import re
import warnings
import zipfile
from array import array
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.quantity import closest
from drake_disasm.common.text import clipped
from drake_disasm.logs.importing.heads import PEEKED, Head, head_of, names_of
from drake_disasm.logs.importing.stream import Stream, readable
from drake_disasm.logs.importing.tables import (
    TableColumn,
    past_midnight,
    streams_of_columns,
)
from drake_disasm.logs.schema import MOST_CELLS

_MOST_BYTES = 2**33  # unpacked
_MOST_ROWS = 2**20  # Excel's own limit
_MIDNIGHT = datetime.datetime.min
_UTC = datetime.UTC
_EMPTY = (None, "")


def parted(path: Path) -> tuple[Path, str]:
    """Returns the file and the sheet of a path FILE.xlsx:SHEET; "" for no sheet."""
    match = re.fullmatch(r"(.+\.xlsx):(.+)", str(path), re.IGNORECASE)
    return (Path(match[1]), match[2]) if match else (path, "")


def read_xlsx(path: Path, sheet: str = "") -> list[Stream]:
    """Reads one sheet of a workbook as a table, of which `head_of` tells the names.

    Formulas have the values that were saved with them. Dates become seconds since 1970,
    times and durations seconds. Any other text is no number.

    Args:
        path: of the workbook.
        sheet: its name; "" for the only one that holds anything.

    Raises:
        DisasmError: it can't be read, or several sheets hold something.
    """
    import openpyxl

    with readable(path), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of formats: the values alone are read
        with zipfile.ZipFile(path) as archive:
            size = sum(member.file_size for member in archive.infolist())
        if size > _MOST_BYTES:
            raise DisasmError(f"{path}: is too large unpacked; save it as CSV, cut")
        book = openpyxl.load_workbook(
            path, read_only=True, data_only=True, keep_links=False
        )
        with contextlib.closing(book):
            table = _table(path, _rows(path, _chosen(path, book, sheet)))
    return streams_of_columns(path, *table)


def _chosen(path: Path, book: Any, sheet: str) -> Any:
    """Returns the sheet of that name, or the only one with anything in it."""
    by_name = {each.title: each for each in book.worksheets}
    if sheet:
        if sheet not in by_name:
            known = clipped(closest(sheet, list(by_name)))
            raise DisasmError(f"{path}: has no sheet '{clipped(sheet)}'; {known}")
        return by_name[sheet]
    filled = [each for each in by_name.values() if any(_rows(path, each))]
    if len(filled) > 1:
        names = ", ".join(each.title for each in filled)
        raise DisasmError(
            f"{path}: has {len(filled)} sheets, {clipped(names)}; name one, such as "
            f"'{path.name}:{clipped(filled[0].title)}'"
        )
    if not filled:
        raise DisasmError(f"{path}: has no rows")
    return filled[0]


def _rows(path: Path, sheet: Any) -> Iterator[tuple[int, Sequence[Any]]]:
    """Yields each row with anything in it, and its number."""
    sheet.reset_dimensions()  # what a file says of its size may be wrong
    cells = 0
    for number, row in enumerate(sheet.iter_rows(values_only=True), 1):
        cells += len(row)
        if number > _MOST_ROWS or cells > MOST_CELLS:
            raise DisasmError(f"{path}: has more rows than a sheet may have; cut it")
        if any(cell not in _EMPTY for cell in row):
            yield number, row


def _table(
    path: Path, rows: Iterator[tuple[int, Sequence[Any]]]
) -> tuple[Sequence[str], list[TableColumn], Head]:
    """Returns the columns' names, the columns and what stands above them.

    Raises:
        DisasmError: a cell stands beside the table.
    """
    first = list(itertools.islice(rows, PEEKED))
    held = [i for _, row in first for i, cell in enumerate(row) if cell not in _EMPTY]
    begin = min(held, default=0)
    head = head_of([_trimmed(row)[begin:] for _, row in first], _is_number, True)
    end = begin + head.width
    columns = [_Column() for _ in range(head.width)]
    for number, row in itertools.chain(first[head.rows :], rows):
        if any(cell not in _EMPTY for cell in (*row[:begin], *row[end:])):
            raise DisasmError(
                f"{path}: row {number} has cells beside the {head.width} columns of "
                "the table; name each column, and clear other cells"
            )
        for column, cell in itertools.zip_longest(columns, row[begin:end]):
            column.add(number, cell)
    if not columns or not len(columns[0].values):
        raise DisasmError(f"{path}: has no rows")
    names = head.names or names_of([""] * head.width)
    return names, [column.done for column in columns], head


def _trimmed(row: Sequence[Any]) -> Sequence[Any]:
    """Returns a row up to its last cell that is not empty."""
    end = max((i for i, cell in enumerate(row) if cell not in _EMPTY), default=-1)
    return row[: end + 1]


class _Column:
    """The cells of a column, as numbers."""

    def __init__(self) -> None:
        self.values = array("d")
        self._filled = self._wrong = self._clocks = 0
        self._first = list[str]()

    def add(self, number: int, cell: Any) -> None:
        """Adds the cell of a row of this number."""
        value = _number(cell)
        self._filled += cell not in _EMPTY
        self._clocks += value is not None and isinstance(_parsed(cell), datetime.time)
        if value is None:
            self._wrong += 1
            if len(self._first) < 3:
                self._first.append(f"'{clipped(str(cell))}' in row {number}")
        self.values.append(math.nan if value is None else value)

    @property
    def done(self) -> TableColumn:
        """The column."""
        values = np.array(self.values)
        if self._clocks and self._clocks == np.isfinite(values).sum():
            values = past_midnight(values)
        return TableColumn(values, self._filled, self._wrong, tuple(self._first))


def _is_number(cell: Any) -> bool:
    return _number(cell) is not None


def _parsed(cell: Any) -> Any:
    """Returns what a text says, where that is a number, a date or a time of day."""
    if not isinstance(cell, str):
        return cell
    ways: tuple[Callable[[str], Any], ...] = (
        float,
        datetime.datetime.fromisoformat,
        datetime.time.fromisoformat,
    )
    for way in ways:
        with contextlib.suppress(ValueError):
            return way(cell.replace(",", "."))
    return cell


def _number(cell: Any) -> float | None:
    """Returns a cell as a number, NaN where it has no value; None for text."""
    if isinstance(cell, int | float):
        return float(cell)
    from openpyxl.cell.cell import ERROR_CODES

    if cell is None or cell == "" or cell in ERROR_CODES:
        return math.nan
    found = _parsed(cell)
    if isinstance(found, str):
        return None
    return found if isinstance(found, float) else _seconds(found)


def _seconds(
    time: datetime.datetime | datetime.date | datetime.time | datetime.timedelta,
) -> float:
    """Returns seconds since 1970 of a date (UTC, where no zone is said), or as said."""
    if isinstance(time, datetime.timedelta):
        return time.total_seconds()
    if isinstance(time, datetime.time):
        return (datetime.datetime.combine(_MIDNIGHT, time) - _MIDNIGHT).total_seconds()
    if not isinstance(time, datetime.datetime):
        time = datetime.datetime.combine(time, datetime.time())
    return (time if time.tzinfo else time.replace(tzinfo=_UTC)).timestamp()
