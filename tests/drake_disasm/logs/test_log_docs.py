"""docs/reference/log-format.md says what the code does."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from drake_disasm.logs import KINDS, read_log
from drake_disasm.logs.schema import Form, Kind, Quantity

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs" / "reference" / "log-format.md").read_text()
_FENCE = re.compile(r"^```\w+ (\S+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
EXAMPLES = dict(_FENCE.findall(PAGE))


@pytest.mark.parametrize("kind", KINDS)
def test_examples_are_logs(kind, tmp_path):
    for name in ("log.yaml", "episode_0000.csv"):
        (tmp_path / name).write_text(EXAMPLES[f"{kind}/{name}"])
    log = read_log(tmp_path)
    assert log.header.kind == kind
    assert log.episodes[0].rows >= 3


def test_usage_example(tmp_path):
    command = [sys.executable, "-c", EXAMPLES["usage.py"]]
    environment = {"PYTHONPATH": str(ROOT), "PATH": "/usr/bin:/bin"}
    said = subprocess.check_output(command, cwd=tmp_path, env=environment, text=True)
    assert said.startswith("(100, 2) ")
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
