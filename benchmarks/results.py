"""Measurements that the manual shows: how a benchmark writes one, and how it is read.

A result is a table with what produced it: the command, the commit, the date and the
machine. `python benchmarks/results_pages.py` makes the pages in docs/results of them.
"""

import argparse
import dataclasses
import json
import math
import os
import platform
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import make_folder, read_text, write_text
from drake_disasm.common.plain_data import check_like
from drake_disasm.common.program import provenance
from drake_disasm.common.text import clipped, shown

Cell = str | int | float

_MOST_BYTES = 2**20
_REMEDY = "write it by the benchmark's --results"
_TEXTS = ("title", "command", "commit", "date", "machine", "written_by", "note")


@dataclasses.dataclass(frozen=True)
class Result:
    """A table of a measurement, and where it is from.

    Attributes:
        title: the caption.
        columns: the heads, with units: "error [N]".
        rows: each as long as `columns`.
        command: that repeats the measurement.
        commit: of the code that was measured.
        date: as 2026-11-20, or "not recorded".
        machine: cores and architecture, or "not recorded".
        written_by: the program, or "transcribed from the manual at COMMIT".
        note: a sentence below the table, or nothing.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    command: str
    commit: str
    date: str
    machine: str
    written_by: str
    note: str = ""


def add_results_argument(parser: argparse.ArgumentParser) -> None:
    """Adds --results to a benchmark's parser."""
    parser.add_argument(
        "--results",
        type=Path,
        metavar="FILE",
        help="also write the table for the manual: docs/results/data/NAME.json",
    )


def write_result(
    path: Path | None,
    title: str,
    columns: Sequence[str],
    rows: Sequence[Sequence[Cell]],
    program: str,
    arguments: Sequence[str],
    note: str = "",
) -> None:
    """Writes a table with the commit, the date and the machine of this process.

    Args:
        path: as `--results` gives it; nothing is written if it is None.
        title: the caption.
        columns: the heads, with units.
        rows: each as long as `columns`.
        program: such as "benchmarks/stalls.py".
        arguments: of its command line; --results and its file are left out.
        note: a sentence below the table.
    """
    if path is None:
        return
    origin = provenance(f"python {program}", _repeatable(arguments), seed=0)
    content = {
        "title": title,
        "columns": list(columns),
        "rows": [list(row) for row in rows],
        "command": origin["command"],
        "commit": origin["commit"],
        "date": origin["date"].partition("T")[0],
        "machine": machine(),
        "written_by": program,
        "note": note,
    }
    _parsed(content)
    make_folder(path.parent)
    write_text(path, as_json(content))


def read_result(path: Path) -> Result:
    """Returns the measurement in a file.

    Raises:
        DisasmError: it can't be read, or is no table with all of `Result` in it.
    """
    text = read_text(path, _REMEDY, _MOST_BYTES)
    try:
        return _parsed(json.loads(text, object_pairs_hook=_without_twins))
    except (DisasmError, ValueError, RecursionError) as error:
        raise DisasmError(f"{path}: {clipped(str(error), 200)}; {_REMEDY}") from None


def as_json(content: dict[str, Any]) -> str:
    """Returns a measurement as JSON with one line for each row."""
    rows = ",\n".join(f"    {_json(row)}" for row in content["rows"])
    lines = [
        f"  {json.dumps(key)}: "
        + (
            f"[\n{rows}\n  ]"
            if key == "rows"
            else json.dumps(value, ensure_ascii=False)
        )
        for key, value in content.items()
    ]
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _json(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False)


def markdown(columns: Sequence[str], rows: Sequence[Sequence[Cell]]) -> str:
    """Returns a table as Markdown; columns of numbers are aligned to the right."""
    ends = [
        "---:" if _are_numbers(cells) else "---" for cells in zip(*rows, strict=True)
    ]
    lines = (columns, ends or ["---"] * len(columns), *rows)
    return "\n".join(f"| {' | '.join(map(_cell, line))} |" for line in lines)


def _are_numbers(cells: Sequence[Cell]) -> bool:
    return all(not isinstance(cell, str) for cell in cells)


def _cell(value: Cell) -> str:
    return str(value).replace("|", "\\|").replace("\n", " ")


def significant(value: float, digits: int = 4) -> float:
    """Returns a number with so many significant digits, for a table."""
    return float(f"{value:.{digits}g}")


def machine() -> str:
    """Returns this machine's cores and architecture."""
    count = os.cpu_count() or 1
    return f"{count} core{'s' * (count > 1)}, {platform.machine()}"


def _repeatable(arguments: Sequence[str]) -> list[str]:
    """Returns a command line without --results and its file."""
    kept = list(arguments)
    if "--results" in kept:
        at = kept.index("--results")
        del kept[at : at + 2]
    return [a for a in kept if not a.startswith("--results=")]


def _without_twins(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    names = [name for name, _ in pairs]
    for name in names:
        if names.count(name) > 1:
            raise DisasmError(f"key '{name}' is given twice")
    return dict(pairs)


def _parsed(content: Any) -> Result:
    """Returns plain data as a result; refuses any that are none."""
    check_like(content, dict.fromkeys(_TEXTS, "") | {"columns": [""], "rows": [[]]})
    known = {field.name for field in dataclasses.fields(Result)}
    if unknown := sorted(set(content) - known):
        raise DisasmError(f"key '{clipped(unknown[0])}' is unknown")
    if not content["title"] or not content["columns"] or not content["rows"]:
        raise DisasmError("title, columns or rows are empty")
    width = len(content["columns"])
    for number, row in enumerate(content["rows"], start=1):
        _check_row(row, number, width)
    rows = tuple(tuple(row) for row in content["rows"])
    return Result(**(content | {"columns": tuple(content["columns"]), "rows": rows}))


def _check_row(row: list[Any], number: int, width: int) -> None:
    if len(row) != width:
        raise DisasmError(f"row {number} has {len(row)} cells for {width} columns")
    for cell in row:
        is_number = type(cell) in (int, float) and math.isfinite(cell)
        if not (is_number or type(cell) is str):
            raise DisasmError(
                f"row {number} has {shown(cell)}, which is no text or finite number"
            )
