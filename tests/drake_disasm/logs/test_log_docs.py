"""docs/reference/log-format.md says what the code does."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from drake_disasm.logs import KINDS, SCHEMA, SI_UNITS, read_log
from drake_disasm.logs.schema import Form, Kind, Quantity

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs" / "reference" / "log-format.md").read_text()
_FENCE = re.compile(r"^```\w+ (\S+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
EXAMPLES = dict(_FENCE.findall(PAGE))


def _write_example(kind: str, folder: Path) -> Path:
    for name, text in EXAMPLES.items():
        if Path(name).parent.name == kind and not name.endswith(".py"):
            (folder / Path(name).name).write_text(text)
    return folder


def test_page_has_an_example_of_each_kind():
    for kind in KINDS:
        assert {f"{kind}/log.yaml", f"{kind}/episode_0000.csv"} <= set(EXAMPLES)


@pytest.mark.parametrize("kind", KINDS)
def test_examples_are_logs(kind, tmp_path):
    log = read_log(_write_example(kind, tmp_path))
    assert log.header.kind == kind
    assert log.episodes[0].rows >= 3


def _run(code: str, folder: Path) -> str:
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=folder,
        env={"PYTHONPATH": str(ROOT), "PATH": "/usr/bin:/bin"},
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stdout


def test_usage_example(tmp_path):
    assert _run(EXAMPLES["usage.py"], tmp_path).startswith("(100, 2) ")
    assert read_log(tmp_path / "my_log").header.provenance["program"] == "usage.py"


def _label(quantity: Quantity) -> str:
    """How the page's tables write the columns of a quantity."""
    suffix = {
        Form.SCALAR: "",
        Form.VECTOR: ".{" + ",".join(quantity.components) + "}",
        Form.JOINTS: ".{i}",
        Form.TERMS: ".<term>",
    }
    return f"`{quantity.name}{suffix[quantity.form]}`"


def _needed(kind: Kind, quantity: Quantity) -> str:
    others = [name for name in kind.one_of if name != quantity.name]
    if quantity.name in kind.one_of:
        return f"this or `{others[0]}`"
    return "yes" if quantity.required else "no"


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_tables_are_the_schema(kind):
    section = PAGE.split(f"\n## {kind.name}\n")[1].split("\n## ")[0]
    rows = [line.split(" | ") for line in section.splitlines() if line[:3] == "| `"]
    # `extra` is of every kind, and said once.
    shown = [q for q in kind.quantities if q.name != "extra"]
    has_frames = any(quantity.frames for quantity in shown)
    for row, quantity in zip(rows, shown, strict=True):
        frame = [" or ".join(quantity.frames) or "\N{EN DASH}"] if has_frames else []
        wanted = [_label(quantity), quantity.unit, *frame, _needed(kind, quantity)]
        assert row[:-1] == [f"| {wanted[0]}", *wanted[1:]]


def test_page_states_schema_and_units():
    assert PAGE.count(f"schema: {SCHEMA}\n") == len(KINDS)
    units = ", ".join(f"{quantity}: {unit}" for quantity, unit in SI_UNITS.items())
    assert PAGE.count("units: {" + units + "}") == len(KINDS)
