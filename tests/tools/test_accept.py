"""tools/accept.py as a user runs it."""

import json
from pathlib import Path

import pytest

from tests.tools.inputs import write_closed, write_policy
from tests.tools.programs import assert_one_line, run_program

_NARROW = {
    "CommandGain.x": {
        "value": -0.1,
        "unit": "1",
        "interval_95": [-0.2, 0.0],
        "is_at_bound": False,
    }
}


def test_an_accepted_policy_is_recommended(tmp_path: Path) -> None:
    closed = write_closed(tmp_path / "closed", parameters=_NARROW)
    done = run_program(
        "accept", "--policy", "straight", "--closed", closed, "--draws=2", "--workers=1"
    )
    assert done.returncode == 0, done.stderr
    assert "accepted: take straight" in done.stdout
    result = json.loads((closed / "accept/result.json").read_text())
    assert result["recommended"] == "straight" and result["reservations"] == []
    assert result["policies"][0]["successes"] == 2
    assert (closed / "accept/report.html").is_file()
    assert not (closed / "accept/episodes").exists()


def test_a_refused_one_is_status_3_and_the_reason(tmp_path: Path) -> None:
    closed, out = write_closed(tmp_path / "closed", gain=-0.4), tmp_path / "out"
    done = run_program(
        "accept", "--policy=straight", "--closed", closed, "--draws=2", "--workers=1",
        "--out", out,
    )  # fmt: skip
    assert done.returncode == 3, done.stderr
    assert "step limit at the verdict's values" in done.stdout
    assert "the nominal twin accepts straight" in done.stdout
    assert json.loads((out / "result.json").read_text())["accepted"] is False


def test_acceptance_claims_no_more_than_the_verdict(tmp_path: Path) -> None:
    left = {"parameters": _NARROW, "left_in_channels": [{"channel": "tz"}]}
    closed = write_closed(tmp_path / "closed", **left)
    done = run_program(
        "accept", "--policy=straight", "--closed", closed, "--draws=1", "--workers=1"
    )
    assert done.returncode == 0, done.stderr
    assert "under a model that leaves something unexplained in tz" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--policy=straight", "--closed=nothing"], ["no result.json", "close-loop"]),
        (["--policy=strait", "--closed=closed"], ["did you mean 'straight'"]),
        (["--policy=slow.npz", "--closed=closed"], ["task.period"]),
    ],
)
def test_bad_input_is_one_line(
    arguments: list[str], words: list[str], tmp_path: Path
) -> None:
    write_closed(tmp_path / "closed")
    write_policy(tmp_path / "slow.npz", period=0.2)
    assert_one_line(run_program("accept", *arguments, cwd=tmp_path), words)
    assert not (tmp_path / "closed/accept").exists()
