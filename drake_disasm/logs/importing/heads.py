"""Where a table begins: what stands above its names, its names, units and rows."""

import collections
import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

from drake_disasm.logs.importing.units import UNITS

#: So many rows are looked at; a preamble is shorter.
PEEKED = 256

IsNumber = Callable[[Any], bool]
_EMPTY = (None, "")


@dataclasses.dataclass(frozen=True)
class Head:
    """What stands above a table's rows of numbers.

    Attributes:
        names: of its columns; () without a row of names.
        units: of its columns, "" where none is said; () without a row of units.
        width: how many columns it has.
        skipped: rows above the names, which are none of the table's.
        rows: all of these, with those of names and units.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    width: int
    skipped: int
    rows: int

    @property
    def labels(self) -> dict[str, str]:
        """Names with their units behind them in brackets, by the names."""
        pairs = zip(self.names, self.units, strict=False)
        return {name: f"{name} [{unit}]" for name, unit in pairs if unit}


def head_of(
    rows: Sequence[Sequence[Any]], is_number: IsNumber, is_ragged: bool = False
) -> Head:
    """Returns what stands above a table's rows of numbers.

    Rows of numbers tell how many columns there are. A heading has text over most of
    the columns that hold numbers. Of the headings above the first rows of numbers, that
    with the most words has the names, or the last of several.

    Args:
        rows: the first ones with anything in them, of cells.
        is_number: whether a cell that is not empty is a number, or a time.
        is_ragged: whether rows end with their last cell that is not empty.
    """
    table = _Table(rows, is_number, is_ragged)
    begin, width = table.begin, table.width
    above = [i for i in range(begin) if table.is_heading(rows[i])]
    above = [i for i in above if table.fits(rows[i])]
    has_units = len(above) > 1 and table.has_units(rows[above[-1]])
    below = above.pop() if has_units else None
    if not above:
        return Head((), (), width - table.ends_empty, begin, begin)
    # Without a column of numbers nothing tells names from rows.
    last = max(above, key=lambda i: (len(table.words(rows[i])), i))
    at = last if table.numbers else above[0]
    names = _padded(rows[at], width)
    width -= table.ends_empty and names[-1] in _EMPTY
    return Head(
        names_of(names[:width]),
        () if below is None else tuple(map(_unit, _padded(rows[below], width))),
        width,
        at,
        1 + (at if below is None else below),
    )


def names_of(cells: Sequence[Any]) -> tuple[str, ...]:
    """Returns the names that a row of cells has, column_0, ... of empty ones."""
    words = [" ".join(str(cell).split()) if cell is not None else "" for cell in cells]
    return tuple(word or f"column_{i}" for i, word in enumerate(words))


class _Table:
    """The first rows of a table, and which of its columns hold numbers."""

    def __init__(
        self, rows: Sequence[Sequence[Any]], is_number: IsNumber, is_ragged: bool
    ) -> None:
        self._rows, self._is_number, self._is_ragged = rows, is_number, is_ragged
        whole = [row for row in rows if self._numbers(row) > self._texts(row)] or rows
        count = collections.Counter(len(row) for row in whole)
        self.width = max(count, key=lambda n: (count[n], n), default=0)
        #: Whether every row of numbers has a delimiter behind its last cell.
        self.ends_empty = all(row[-1:] in ([""], [None]) for row in whole)
        fitting = [row for row in whole if len(row) == self.width]
        columns = list(zip(*fitting, strict=True))
        self.numbers = [
            i
            for i, cells in enumerate(columns)
            if self._numbers(cells) >= max(self._texts(cells), 1)
        ]

    def _numbers(self, cells: Sequence[Any]) -> int:
        return sum(cell not in _EMPTY and self._is_number(cell) for cell in cells)

    def _texts(self, cells: Sequence[Any]) -> int:
        return sum(cell not in _EMPTY for cell in cells) - self._numbers(cells)

    def fits(self, row: Sequence[Any]) -> bool:
        """Whether a row has a cell for each column, but for an empty one at the end."""
        if self._is_ragged:
            return len(row) <= self.width
        return len(row) in (self.width, self.width - self.ends_empty)

    def is_heading(self, row: Sequence[Any]) -> bool:
        """Whether a row is none of the table's numbers."""
        if not self._texts(row):
            return False
        over = [row[i] for i in self.numbers if i < len(row)]
        return not self.fits(row) or self._texts(over) >= self._numbers(over)

    @property
    def begin(self) -> int:
        """The first row of two that are no headings."""
        headings = [self.is_heading(row) for row in self._rows]
        pairs = zip(headings, [*headings[1:], False], strict=True)
        return next((i for i, pair in enumerate(pairs) if not any(pair)), len(headings))

    def words(self, row: Sequence[Any]) -> set[str]:
        """Returns the different texts in a row."""
        return {
            str(cell)
            for cell in row
            if cell not in _EMPTY and not self._is_number(cell)
        }

    def has_units(self, row: Sequence[Any]) -> bool:
        """Whether half of the cells above numbers are units."""
        over = [str(row[i]) for i in self.numbers if i < len(row)]
        filled = [cell for cell in over if cell not in _EMPTY]
        return 2 * sum(_unit(cell) in UNITS for cell in filled) >= max(len(filled), 1)


def _padded(row: Sequence[Any], width: int) -> list[Any]:
    return [*row, *[None] * (width - len(row))]


def _unit(cell: Any) -> str:
    """Returns the unit in a cell, without the brackets round it."""
    return "" if cell is None else str(cell).strip().strip("[]()").strip()
