"""Sheets of Excel's workbooks (.xlsx), read by openpyxl."""

import contextlib
import datetime
import math
import re
import warnings
import zipfile
from array import array
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.quantity import closest
from drake_disasm.common.text import clipped
from drake_disasm.importing.stream import Stream, readable
from drake_disasm.importing.tables import streams_of_columns
from drake_disasm.logs.schema import MOST_CELLS

_MOST_BYTES = 2**33  # unpacked
_MOST_ROWS = 2**20  # Excel's own limit
_MIDNIGHT = datetime.datetime.min
_UTC = datetime.UTC


def parted(path: Path) -> tuple[Path, str]:
    """Returns the file and the sheet of a path FILE.xlsx:SHEET; "" for no sheet."""
    match = re.fullmatch(r"(.+\.xlsx):(.+)", str(path), re.IGNORECASE)
    return (Path(match[1]), match[2]) if match else (path, "")


def read_xlsx(path: Path, sheet: str = "") -> list[Stream]:
    """Reads one sheet of a workbook as a table, with the columns' names in its top row.

    Formulas have the values that were saved with them. Dates become seconds since 1970,
    times and durations seconds. A column with any other text is left out.

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
            names, columns = _table(path, _rows(path, _chosen(path, book, sheet)))
    return streams_of_columns(path, names, columns)


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
        if any(cell not in (None, "") for cell in row):
            yield number, row


def _table(
    path: Path, rows: Iterator[tuple[int, Sequence[Any]]]
) -> tuple[list[str], list[np.ndarray | None]]:
    """Returns the columns' names, and their numbers (n,); None for text.

    Names are in the top row, or column_0, ... if that has numbers alone.

    Raises:
        DisasmError: a cell stands beside the table that the top row heads.
    """
    _, top = next(rows, (1, ()))
    held = [i for i, cell in enumerate(top) if cell not in (None, "")]
    first, end = min(held, default=0), max(held, default=-1) + 1
    values = [array("d") for _ in range(first, end)]
    texts = set[int]()
    names = [
        f"column_{i}" if cell is None else " ".join(str(cell).split())
        for i, cell in enumerate(top[first:end])
    ]
    if all(_number(cell) is not None for cell in top[first:end]):
        names = [f"column_{i}" for i in range(end - first)]
        _append(values, texts, top[first:end])
    for number, row in rows:
        if any(cell not in (None, "") for cell in (*row[:first], *row[end:])):
            raise DisasmError(
                f"{path}: row {number} has cells beside the {end - first} columns of "
                "the top row; name each column there, and clear other cells"
            )
        _append(values, texts, row[first:end])
    if not values or not len(values[0]):
        raise DisasmError(f"{path}: has no rows")
    columns = [None if i in texts else np.array(v) for i, v in enumerate(values)]
    return names, columns


def _append(values: "list[array[float]]", texts: set[int], row: Sequence[Any]) -> None:
    """Appends a row to the columns, and notes which of them hold text."""
    for i, column in enumerate(values):
        number = _number(row[i]) if i < len(row) else math.nan
        if number is None:
            texts.add(i)
        column.append(math.nan if number is None else number)


def _number(cell: Any) -> float | None:
    """Returns a cell as a number, NaN where it has no value; None for text."""
    if isinstance(cell, int | float):
        return float(cell)
    from openpyxl.cell.cell import ERROR_CODES

    if cell is None or cell == "" or cell in ERROR_CODES:
        return math.nan
    if isinstance(cell, str):
        try:
            return float(cell.replace(",", "."))
        except ValueError:
            pass
        try:
            cell = datetime.datetime.fromisoformat(cell)
        except ValueError:
            return None
    return _seconds(cell)


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
