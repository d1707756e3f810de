"""tools/evaluate.py as a user runs it."""

import json
import subprocess
from pathlib import Path

import pytest

from tests.tools.programs import assert_one_line, run_program

SHORT = ["--station=twin", "--episodes=2", "--set", "task.steps=5"]


def _evaluate(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return run_program("evaluate", *arguments, cwd=folder)


def test_policies_and_settings_make_the_lines(tmp_path: Path) -> None:
    done = _evaluate(
        tmp_path, *SHORT, "--scenario=removal_turned", "--policy", "straight",
        "admittance", "--sweep", "effects.0.ry=0,0.15", "--json", "out/figures.json",
        "--workers=1",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert len(done.stdout.splitlines()) == 5
    rows = json.loads((tmp_path / "out/figures.json").read_text())["rows"]
    assert [row["policy"] for row in rows] == ["straight", "admittance"] * 2
    straight = [row["mean_force"] for row in rows if row["policy"] == "straight"]
    assert straight[1] > straight[0] + 0.05


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--policy", "adnittance"], "did you mean 'admittance'"),
        (["--policy", "straight", "--sweep", "imprecision"], "key=value,value"),
        (["--policy", "straight", "--psi", "0.5"], "out of range"),
    ],
)
def test_bad_input_is_one_line(
    arguments: list[str], message: str, tmp_path: Path
) -> None:
    assert_one_line(_evaluate(tmp_path, *SHORT, *arguments), [message])
