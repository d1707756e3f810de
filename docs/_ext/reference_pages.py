"""Writes the pages of docs/reference that are made of the code itself.

`python docs/_ext/reference_pages.py` (or `make reference`) writes effects.md and
experiments.md from their registries, scenario.md and settings.md from the fields of
dataclasses, and command-line.md from the programs' parsers.
"""

import argparse
import contextlib
import dataclasses
import importlib
import inspect
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any
from unittest import mock

from docstrings import QUANTITY_HEAD, SETTING_HEAD, quantity_rows, setting_rows
from drake_disasm_cli.main import COMMANDS

from drake_disasm.common.files import write_text
from drake_disasm.effects import registered_effects
from drake_disasm.effects.documentation import documentation
from drake_disasm.experiments import (
    FREE_SPACE,
    registered_experiments,
    registered_joint_experiments,
)
from drake_disasm.learning.hyperparameters import Hyperparameters
from drake_disasm.parts import registered_parts
from drake_disasm.scenario.schema import Scenario
from drake_disasm.stations.hardware_config import HardwareConfig
from sysid.data_checks.settings import DataSettings
from sysid.fitting.settings import SelectionSettings

FOLDER = Path(__file__).parents[1] / "reference"

_GENERATED = "<!-- Written by `make reference`; edit the code that it describes. -->"
_EFFECTS = """# Effects

An effect is something that a model can lack: a rotated groove, rust, backlash, drift.
A scenario lists effects (`- !GroovePose {ry: 0.0349}`), the stations simulate them,
identification fits them (`GroovePose.ry`), and closing the loop proposes them.

An **amplitude** is zero where the effect vanishes. A **shape parameter** says how the
effect looks; its default is in brackets. Effects of the sensor act in the order load,
mounting, elements, electronics, range, report, whatever their order in the list.
[Your own effect](../guides/own-effect.md) adds one."""
_EXPERIMENTS = """# Experiments

A station performs an experiment to find out what its model lacks:
[`drake-disasm diagnose`](../guides/diagnose.md) chooses among them, in all combinations
of the values in brackets."""
_SCENARIO = """# Scenario

A scenario is a YAML file that defines one Drake diagram, or a family of them. Every key
has a default, so that a file states only what differs. Unknown keys, wrong types and
values out of bounds are refused with their line and the remedy.

```yaml
name: my_cell
part: !DoorChain {clearance: 0.0003}  # m
effects:
  - !GroovePose {ry: 0.0349}        # rad
randomisation:
  - {parameter: part.clearance, low: 0.0003, high: 0.0006}
```

`--set part.clearance=0.0002` changes one key from the command line. The shipped
scenarios are in [`models/scenarios/`](../../models/scenarios)."""
_SETTINGS = """# Settings

The numbers that a program works with, with the reason for each default. In Python each
table is a dataclass; `dataclasses.replace(settings, alpha=0.01)` changes a field."""
_COMMANDS = """# Command line

`drake-disasm COMMAND --help` prints what stands here. In a checkout,
`python tools/simulate.py` is the same as `drake-disasm simulate`; a dash becomes an
underscore."""

#: Classes on the page of settings, with who uses them.
_CLASSES = (
    ("Learning", Hyperparameters, "`drake-disasm train --hyper KEY=VALUE`"),
    ("Hardware configuration", HardwareConfig, "the file of `--hardware-config`"),
    ("Effect selection", SelectionSettings, "`close_loop(..., settings=...)`"),
    ("Checks of the data", DataSettings, "`drake-disasm check-log`"),
)


def pages() -> dict[str, str]:
    """Returns the Markdown of each page, by file name."""
    return {
        "effects.md": _page(_EFFECTS, effects()),
        "experiments.md": _page(_EXPERIMENTS, "\n".join(_experiments())),
        "scenario.md": _page(
            _SCENARIO, "\n".join([*_sections(Scenario, 2), *_parts()])
        ),
        "settings.md": _page(_SETTINGS, "\n".join(_settings())),
        "command-line.md": _page(_COMMANDS, "\n".join(_commands())),
    }


def _page(head: str, body: str) -> str:
    return f"{_GENERATED}\n\n{head}\n\n{body.strip()}\n"


def effects() -> str:
    """Returns every effect of the library, in sections by where it acts."""
    library = [e for e in registered_effects() if e.__module__.startswith("drake_dis")]
    return documentation(library)


def _experiments() -> Iterator[str]:
    """Yields the experiments of the library, each as a section."""
    for kind in (*registered_experiments(), *registered_joint_experiments()):
        if kind.__module__.startswith("drake_disasm."):
            text = inspect.getdoc(kind) or ""
            yield from (f"## {kind.__name__}", "", text, "")
            if needs := getattr(kind, "needs", FREE_SPACE):
                yield from (f"Needs {needs}.", "")
            rows = [
                (*row[:-1], row[-1] + _tried(field))
                for row, field in zip(
                    quantity_rows(kind), dataclasses.fields(kind), strict=True
                )
            ]
            yield from _table(QUANTITY_HEAD, rows)


def _tried(field: dataclasses.Field[Any]) -> str:
    """Returns the values of a parameter that are tried, in brackets."""
    values = field.metadata["grid"]
    return f" ({', '.join(f'{value:g}' for value in values)})" if values else ""


def _sections(schema: type, depth: int, name: str = "") -> Iterator[str]:
    """Yields a dataclass as a section, then those that its fields hold.

    Args:
        schema: the dataclass.
        depth: of the headings.
        name: of the section in a file; the whole file's has none, and no heading.
    """
    if name:
        yield from (f"{'#' * depth} `{name}`", "", _first_paragraph(schema), "")
    yield from _table(QUANTITY_HEAD, quantity_rows(schema))
    for field in dataclasses.fields(schema):
        inner = _section_type(field)
        if inner is not None:
            yield from _sections(inner, depth, f"{name}.{field.name}".lstrip("."))


def _parts() -> Iterator[str]:
    """Yields the parts of the library, each as a section."""
    yield from (
        "## `part`",
        "",
        "What is taken apart: `part: !PegInHole {depth: 0.03}`.",
    )
    for part in registered_parts():
        if part.__module__.startswith("drake_disasm."):
            yield from ("", f"### `!{part.__name__}`", "", _first_paragraph(part), "")
            yield from _table(QUANTITY_HEAD, quantity_rows(part))


def _section_type(field: dataclasses.Field[Any]) -> type | None:
    """Returns the dataclass that a field holds, alone or in a list; None if none."""
    inner = getattr(field.type, "__args__", (field.type,))[0]
    has_fields = dataclasses.is_dataclass(inner) and dataclasses.fields(inner)
    return inner if isinstance(inner, type) and has_fields else None


def _settings() -> Iterator[str]:
    for title, cls, use in _CLASSES:
        yield from (f"## {title}", "", f"{_name(cls)}, of {use}.", "")
        yield from _sections(cls, 3)
        yield from _table(SETTING_HEAD, setting_rows(cls))


def _name(cls: type) -> str:
    return f"`{cls.__module__}.{cls.__name__}`"


def _first_paragraph(cls: type) -> str:
    text = inspect.getdoc(cls) or ""
    return " ".join(text.split("\n\n")[0].split())


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    if not rows:
        return
    for row in (head, ["---"] * len(head), *rows):
        yield f"| {' | '.join(' '.join(cell.split()) for cell in row)} |"
    yield ""


def _commands() -> Iterator[str]:
    for group, commands in COMMANDS.items():
        yield from (f"## {group[0].upper()}{group[1:]}", "")
        for name in commands:
            yield from _command(name)


def _command(name: str) -> Iterator[str]:
    """Yields a subcommand: what it does, its examples, its options."""
    parser = parser_of(name)
    yield from (f"### {name}", "", inspect.cleandoc(parser.description or ""), "")
    if parser.epilog:
        yield from ("```text", parser.epilog.strip(), "```", "")
    shown = [a for a in parser._actions if a.help != argparse.SUPPRESS]
    rows = [_option(a) for a in shown if not isinstance(a, argparse._HelpAction)]
    yield from _table(("argument", "meaning"), rows)


def parser_of(name: str) -> argparse.ArgumentParser:
    """Returns a subcommand's parser, as its `parse` makes it."""
    made: list[argparse.ArgumentParser] = []

    def stop(parser: argparse.ArgumentParser, *_: object) -> None:
        """Keeps the parser instead of parsing."""
        made.append(parser)
        raise StopIteration

    module = importlib.import_module(f"drake_disasm_cli.{name.replace('-', '_')}")
    patched = mock.patch.object(argparse.ArgumentParser, "parse_args", stop)
    with patched, contextlib.suppress(StopIteration):
        module.parse([])
    return made[0]


def _option(action: argparse.Action) -> tuple[str, str]:
    """Returns an argument as it is typed, and its help."""
    name = ", ".join(action.option_strings)
    values = _values(action)
    meaning = " ".join((action.help or "").split()).replace("|", "\\|")
    required = "required; " * bool(action.option_strings and action.required)
    typed = f"{name} {values}".strip().replace("|", "\\|")
    return f"`{typed}`", f"{required}{meaning}"


def _values(action: argparse.Action) -> str:
    """Returns what follows an option, or stands for a positional argument."""
    if action.nargs == 0:
        return ""
    one = action.metavar or action.dest.upper()
    if action.choices and not action.metavar:
        one = "|".join(map(str, action.choices))
    if isinstance(one, tuple):
        return " ".join(one)
    if isinstance(action.nargs, int):
        return " ".join([one] * action.nargs)
    forms = {"+": "{0} [{0} ...]", "*": "[{0} ...]", "?": "[{0}]"}
    return forms.get(str(action.nargs), "{0}").format(one)


if __name__ == "__main__":
    for file, text in pages().items():
        write_text(FOLDER / file, text)
