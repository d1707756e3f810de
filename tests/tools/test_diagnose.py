"""tools/diagnose.py: input that can't be used is refused before the robot moves."""

import io

import pytest

from drake_disasm.scenario import load_scenario
from tests.tools.programs import run_program

_TWIN = ("--set", "contact.model=impact", "--station", "twin")
_ARM = ("--kind", "joint_motion")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--experiments", "Reversal"], "did you mean 'Reversals'"),
        (["--experiments", "none.py"], "no such file"),
        ([*_TWIN, "--robot-time", "1", "--yes"], "before the first verdict take about"),
        (["--station", "hardware", "--yes"], "--hardware-config"),
        (["--hidden", "nowhere", "--yes"], "nowhere"),
        (_TWIN, "give --yes"),
        ([*_ARM, "--station", "twin"], "no arm to move"),
        ([*_ARM, "--html"], "--html: an arm in free space has none"),
        ([*_ARM, "--experiments", "Presses"], "Presses: not for --kind joint_motion"),
        (["--experiments", "JointStrokes"], "not for --kind transitions"),
        (_ARM, "give --yes"),
    ],
)
def test_bad_input_is_one_line(arguments, message, tmp_path, monkeypatch):
    monkeypatch.setattr("sys.stdin", io.StringIO())
    run = run_program("diagnose", *arguments, "--out", tmp_path / "out")
    assert run.returncode == 2
    assert message in run.stderr.strip().splitlines()[-1]


@pytest.mark.slow
def test_the_story_is_told(tmp_path):
    run = run_program(
        "diagnose", *_TWIN, "--hidden", "removal_turned",
        "--experiments", "Reversals", "Presses", "--yes", "--out", tmp_path / "out",
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    assert "settled: the model lacks GroovePose" in run.stdout
    assert "GroovePose" in (tmp_path / "out/report.html").read_text()
    (effect,) = load_scenario(tmp_path / "out/scenario.yaml").effects
    (hidden,) = load_scenario("removal_turned").effects
    assert effect.ry == pytest.approx(hidden.ry, rel=0.1)
