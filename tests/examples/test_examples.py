"""Every example runs to its end and prints what it teaches."""

import re
import runpy
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))

#: What each of them must have printed: regular expressions.
PRINTED = {
    "own_diagram": ["watch at http://", r"0\.20", "the bolt is held at A"],
    "cartesian_command": [r"1\.00        10\.00"],
    "outside_force": [r"bolt +-(4\.9|5\.0)", r"-52\.[56]"],
    "own_policy": ["twin        12", "cell        12"],
    "own_environment": [r"last  eight episodes: mean reward  -0\."],
    "own_agent": ["4      120", "8      238"],
    "own_experiment": [r"Staircase\(top=6.0, stairs=3\)", r"11\.\d\d +-[56]\.\d\d"],
    "own_effect": [
        "MagneticCatch  confirmed  force = ",
        r"MagneticCatch\(force=3\.9",
    ],
    "gymnasium_sb3": ["200 steps in ", "steps/s", "outcome: "],
    "own_log_model": ["JointCoulombFriction.pivot  confirmed", r"size = 0\.150"],
    "own_place": ["SheathFriction  confirmed", r"size = 2\.99"],
    "drying_grease": ["DryingGrease  confirmed", r"coefficient = 0\.29"],
    "record_bag": ["bag: ", "wrench 12 ms late"],
    "hardware_station": [r"step  x \[mm\]", "iiwa: READY", "ft_sensor: READY"],
}

#: Those that take longer than others.
SLOW = ("own_effect", "drying_grease", "gymnasium_sb3")

#: What makes an example small.
ARGUMENTS = {"own_environment": ["32"], "own_agent": ["8"]}


@pytest.fixture
def run(
    own_effects: None,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> Callable[..., str]:
    """Runs an example as a program in this process; returns what it prints."""

    def _run(example: Path, *arguments: str) -> str:
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr(sys, "argv", [str(example), *arguments])
        monkeypatch.syspath_prepend(example.parent)
        runpy.run_path(str(example), run_name="__main__")
        return capsys.readouterr().out

    return _run


@pytest.mark.parametrize(
    "example",
    [
        pytest.param(each, marks=[pytest.mark.slow] * (each.stem in SLOW))
        for each in EXAMPLES
    ],
    ids=lambda path: path.stem,
)
def test_example_runs_and_prints(example: Path, run: Callable[..., str]) -> None:
    assert example.stem in PRINTED, "say here what this example has to print"
    printed = run(example, *ARGUMENTS.get(example.stem, ()))
    for words in PRINTED[example.stem]:
        assert re.search(words, printed), printed
    assert not re.search(r"\bnan\b", printed, re.IGNORECASE), printed


def test_own_diagram_swaps_its_station(run: Callable[..., str]) -> None:
    printed = run(ROOT / "examples" / "own_diagram.py", "--station", "hardware")
    assert "the bolt is held at A" in printed
    assert "truly" not in printed
