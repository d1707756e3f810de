"""Every example runs to its end and prints what it teaches."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))

#: What each of them must have printed.
PRINTED = {
    "own_diagram": ["watch at http://", "0.20", "the bolt is held at A"],
    "cartesian_command": ["1.00        10.00"],
    "outside_force": ["bolt           -4.9", "-52.5"],
    "own_policy": ["twin        12", "cell        12"],
    "own_environment": ["last  eight episodes: mean reward  -0."],
    "own_agent": ["12      359", "24      686"],
    "own_effect": ["MagneticCatch  confirmed  force = ", "[MagneticCatch(force=3.9"],
    "gymnasium_sb3": ["200 steps in ", "steps/s", "outcome: "],
    "own_log_model": ["JointCoulombFriction.pivot  confirmed", "size = 0.150"],
    "own_place": ["SheathFriction  confirmed", "size = 2.99"],
    "drying_grease": ["DryingGrease  confirmed", "coefficient = 0.29"],
    "record_bag": ["bag: ", "wrench 12 ms late"],
    "hardware_station": ["step  x [mm]", "iiwa: READY", "ft_sensor: READY"],
}

#: Those that take longer than others.
SLOW = ("own_effect", "drying_grease", "gymnasium_sb3")


@pytest.mark.parametrize(
    "example",
    [
        pytest.param(each, marks=[pytest.mark.slow] * (each.stem in SLOW))
        for each in EXAMPLES
    ],
    ids=lambda path: path.stem,
)
def test_example_runs_and_prints(example: Path, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, str(example)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert example.stem in PRINTED, "say here what this example has to print"
    for words in PRINTED[example.stem]:
        assert words in done.stdout, done.stdout
    assert not re.search(r"\bnan\b", done.stdout, re.IGNORECASE), done.stdout


def test_own_diagram_swaps_its_station() -> None:
    example = ROOT / "examples" / "own_diagram.py"
    done = subprocess.run(
        [sys.executable, example, "--station", "hardware"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "the bolt is held at A" in done.stdout
    assert "truly" not in done.stdout
