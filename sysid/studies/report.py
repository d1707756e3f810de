"""A study's report: Markdown, one HTML page that opens offline, and all rows as CSV."""

import base64
import csv
import io
import os
import platform
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import jinja2

from drake_disasm.common.files import write_text
from sysid.studies.results import aligned, every_seed, every_test
from sysid.studies.runner import SeedResult, finished
from sysid.studies.study import Stage, Study, Table

_ENVIRONMENT = jinja2.Environment(
    loader=jinja2.PackageLoader("sysid.studies", "."),
    autoescape=jinja2.select_autoescape(["html.j2"]),
    trim_blocks=True,
    lstrip_blocks=True,
    undefined=jinja2.StrictUndefined,
)
_FORMATS = ("md", "html")


def write_report(study: Study, folder: Path, origin: Mapping[str, Any]) -> list[Table]:
    """Writes report, figures and all rows of what is finished.

    Args:
        study: what was studied.
        folder: of the study.
        origin: provenance of its beginning, by a command that may have asked for less,
            or for other levels.

    Returns:
        The tables, for the terminal.
    """
    tables = study.tables(folder)
    pictures = study.pictures(folder)
    for picture in pictures:
        picture.draw(folder / picture.name)
    images = {
        p.name: base64.b64encode((folder / p.name).read_bytes()).decode()
        for p in pictures
    }
    stages = list(study.stages(folder))
    everything = {"results": every_seed(_finished_in(stages, folder))}
    elsewhere = every_test([test for s in stages for test in s.tests], folder)
    if elsewhere.rows:
        everything["tests"] = elsewhere
    for kind in _FORMATS:
        text = _ENVIRONMENT.get_template(f"report.{kind}.j2").render(
            study=study,
            own=study.options.provenance or origin,
            origin=origin,
            machine=_machine(),
            tables=[*tables, *everything.values()],
            pictures=pictures,
            images=images,
        )
        write_text(folder / f"report.{kind}", text)
    for name, table in everything.items():
        write_text(folder / f"{name}.csv", _csv(table.columns, table.rows))
    return tables


def _finished_in(stages: Sequence[Stage], folder: Path) -> list[SeedResult]:
    """Returns all trainings of some stages that are finished."""
    found = []
    for stage in stages:
        found += finished(list(stage.treatments), tuple(stage.seeds), folder)
    return found


def as_text(table: Table) -> str:
    """Returns a table for a terminal."""
    lines = aligned([table.columns, *table.rows])
    return "\n".join([f"{table.title}:", *lines, *([table.note] if table.note else [])])


def _csv(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    text = io.StringIO(newline="")
    csv.writer(text, lineterminator="\n").writerows([columns, *rows])
    return text.getvalue()


def _machine() -> str:
    """Returns the machine in words."""
    return f"{platform.platform()}, {os.cpu_count()} cores"
