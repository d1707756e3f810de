"""What is read of Excel's workbooks, and what is refused."""

import datetime
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import openpyxl
import pytest

from drake_disasm.logs.importing import Known, read_source
from drake_disasm.logs.importing.joining import joined
from tests.refusals import refusal

_NAMES = ("t", "q_0")
_ROWS = ((0.0, 1.0 / 3.0), (0.1, 2))


def _book(path: Path, **sheets: Sequence[Sequence[Any]]) -> Path:
    """Writes a workbook of named sheets, rows of cells."""
    book = openpyxl.Workbook()
    book.remove(book.active)
    for name, rows in sheets.items():
        sheet = book.create_sheet(name)
        for row in rows:
            sheet.append(row)
    book.save(path)
    return path


def _channels(path: Path) -> Mapping[str, np.ndarray]:
    [stream] = read_source(path).streams
    return stream.channels


def test_a_sheet_is_a_table(tmp_path: Path) -> None:
    path = tmp_path / "run.xlsx"
    rows = [[None, None, None], ["", *_NAMES], *([None, *row] for row in _ROWS)]
    found = _channels(_book(path, run=rows, empty=[], blank=[["", None]]))
    assert {n: v.tolist() for n, v in found.items()} == {
        "t": [0.0, 0.1],
        "q_0": [pytest.approx(1.0 / 3.0, rel=1e-15), 2.0],
    }
    found = _channels(_book(path, run=_ROWS))  # without names
    assert list(found) == ["column_0", "column_1"] and len(found["column_0"]) == 2


def test_cells_of_every_kind_are_numbers_or_left_out(tmp_path: Path) -> None:
    stamp = datetime.datetime(2024, 5, 1, 12, 0, 0, 250_000)
    cells = {
        "date": (stamp, 1714564800.25),
        "date as text": (stamp.isoformat() + "Z", 1714564800.25),
        "clock": (datetime.time(0, 1, 2, 500_000), 62.5),
        "duration": (datetime.timedelta(seconds=90.5), 90.5),
        "flag": (True, 1.0),
        "comma": ("0,5", 0.5),
        "formula": ("=1+1", np.nan),  # not calculated by what wrote it
        "error": ("#N/A", np.nan),
        "hole": (None, np.nan),
        "note": ("by hand", None),
    }
    first = [cell for cell, _ in cells.values()]
    path = _book(tmp_path / "run.xlsx", run=[list(cells), first, first])
    [stream] = read_source(path).streams
    assert dict(stream.left_out) == {"note": "holds text"}
    for name, (_, expected) in cells.items():
        if expected is not None:
            np.testing.assert_allclose(stream.channels[name], [expected] * 2)


def test_lines_above_and_units_below_the_names_are_no_rows(tmp_path: Path) -> None:
    rows = [["A run"], ["by", "me"], _NAMES, ("ms", "[deg]"), *_ROWS]
    [stream] = read_source(_book(tmp_path / "run.xlsx", run=rows)).streams
    assert {n: len(v) for n, v in stream.channels.items()} == {"t": 2, "q_0": 2}
    assert stream.labels == {"t": "t [ms]", "q_0": "q_0 [deg]"}
    assert stream.notes == ("2 lines above the table skipped",)


def test_a_text_in_a_column_of_numbers_is_missing(tmp_path: Path) -> None:
    rows: list[Sequence[Any]] = [(datetime.time(23, 59, 59), 1.0)] * 9
    rows += [(datetime.time(0, 0, 1), "off")]
    path = _book(tmp_path / "run.xlsx", run=[("t", "q"), *rows])
    [stream] = read_source(path).streams
    assert stream.notes == ("q: 1 cell is no number: 'off' in row 11",)
    assert np.isnan(stream.channels["q"]).tolist() == [False] * 9 + [True]
    assert stream.channels["t"][-1] - stream.channels["t"][0] == 2.0  # past midnight


def test_one_sheet_of_several_is_named(tmp_path: Path) -> None:
    torques = [("t", "tau_0"), (0.0, 5.0), (0.1, 6.0)]
    path = _book(tmp_path / "run.xlsx", **{"q": [_NAMES, *_ROWS], "tau 1": torques})
    message = refusal(read_source, path)
    assert "has 2 sheets, q, tau 1; name one, such as 'run.xlsx:q'" in message
    sources = [read_source(Path(f"{path}:{sheet}")) for sheet in ("q", "tau 1")]
    assert sources[0].sha256 == sources[1].sha256
    both = joined(sources, "rows", Known())
    assert both.streams[0].names == ["t", "q_0", "tau 1.t", "tau_0"]
    message = refusal(read_source, Path(f"{path}:tau_1"))
    assert "has no sheet 'tau_1'; did you mean 'tau 1'?" in message


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ([], "has no rows"),
        ([_NAMES], "has no rows"),
        ([_NAMES, *_ROWS, [0.2, 3.0, "stop"]], "row 4 has cells beside the 2 columns"),
    ],
)
def test_what_is_no_table_is_refused(
    tmp_path: Path, rows: Sequence[Sequence[Any]], said: str
) -> None:
    assert said in refusal(read_source, _book(tmp_path / "run.xlsx", run=rows))


def test_what_is_no_workbook_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "run.xlsx"
    path.write_text("t,q\n0,1\n")
    assert "can't be read: File is not a zip file" in refusal(read_source, path)
    assert "other.xlsx: does not exist" in refusal(
        read_source, tmp_path / "other.xlsx:q"
    )
