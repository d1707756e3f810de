"""check-log: what is wrong with a log, and what it could show."""

import json
from pathlib import Path

import numpy as np
import pytest

from tests.tools.inputs import write_slide_log
from tests.tools.programs import assert_one_line, run_program


def test_a_log_is_described_with_what_it_could_show(tmp_path: Path) -> None:
    log = write_slide_log(tmp_path / "log")
    run = run_program(
        "check-log", "--log", log, "--workers=1", "--json", str(tmp_path / "check.json")
    )
    assert run.returncode == 0, run.stderr
    assert "1 episodes, 3000 rows" in run.stdout and "200 Hz" in run.stdout
    assert "data: nothing is wrong" in run.stdout
    assert "parameters: 1 of 1 are determined" in run.stdout
    found = json.loads((tmp_path / "check.json").read_text())
    [mass] = found["excitation"]["parameters"]
    assert mass["value"] == pytest.approx(95.0, rel=0.2)
    limits = {
        (x["effect"], x["field"]): x["amplitude"]
        for x in found["excitation"]["would_have_been_found"]
    }
    friction = limits["JointCoulombFriction.slide", "size"]
    assert 0.0 < friction < 20.0  # what is there would have been found


def test_a_dead_channel_is_refused(tmp_path: Path) -> None:
    log = write_slide_log(tmp_path / "log", tau=np.zeros(3000))
    run = run_program("check-log", "--log", log, "--workers=1")
    assert_one_line(run, ["slide"])
