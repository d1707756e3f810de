"""tools/play_motion.py: from a motion to a log, hidden friction included; refusals."""

from pathlib import Path

import numpy as np
import pytest

from drake_disasm.free_motion import way
from drake_disasm.logs import read_log
from sysid.models.from_logs import ModelChoice, model_of
from tests.tools.programs import assert_one_line, run_program

_JOINTS = 7


@pytest.fixture
def motion(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A swing of one second; the way to it is hurried."""
    for name, speed in (("_IN_PART", 0.15), ("_OUT", 0.5), ("_TURN", 1.0)):
        monkeypatch.setattr(way, name, speed)
    time = np.linspace(0.0, 1.0, 201)
    swing = 0.05 * (1.0 - np.cos(2.0 * np.pi * time))[:, None] * np.ones(_JOINTS)
    q = np.array([0.0, 0.2, 0.0, -1.4, 0.0, 1.2, 0.0]) - swing
    names = ",".join(["time", *(f"q.{i}" for i in range(_JOINTS))])
    path = tmp_path / "motion.csv"
    np.savetxt(
        path, np.column_stack([time, q]), delimiter=",", header=names, comments=""
    )
    return path


def test_a_hidden_friction_is_in_the_log_and_not_in_what_it_states(
    motion: Path, tmp_path: Path
) -> None:
    hidden = tmp_path / "arm.yaml"
    hidden.write_text(
        "effects: [!JointViscousFriction {joint: iiwa_joint_4, coefficient: 9.0}]\n"
    )
    arguments = (
        motion, "--no-meshcat", "--record", tmp_path / "log", "--hidden", hidden,
    )  # fmt: skip
    run = run_program("play_motion", *arguments)
    assert run.returncode == 0, run.stderr
    assert "s to where the motion begins" in run.stdout
    log = read_log(tmp_path / "log")
    assert log.header.kind == "joint_response" and log.header.provenance["hidden"]
    assert not log.header.scenario["effects"]
    [episode] = log.episodes
    assert episode["time"][-1] == pytest.approx(1.0, abs=0.01)
    assert np.abs(episode["q"] - episode["q_commanded"]).max() < 0.02
    model = model_of([log], ModelChoice())  # the URDF beside the log is the arm's
    assert len(model.joints) == _JOINTS
    again = run_program("play_motion", *arguments)
    assert again.returncode == 2 and "not empty" in again.stderr
    more = run_program("play_motion", *arguments, "--resume")
    assert more.returncode == 0, more.stderr
    assert len(read_log(tmp_path / "log").episodes) == 2


def test_a_motion_that_can_not_be_played_is_refused_before_anything_moves(
    motion: Path, tmp_path: Path
) -> None:
    table = motion.read_text().replace("-1.4", "-2.4", 1)
    motion.write_text(table)
    run = run_program("play_motion", motion, "--record", tmp_path / "log")
    assert run.returncode == 2 and "q.3" in run.stderr
    assert not (tmp_path / "log").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--station", "twin"), "--station twin: has no arm"),
        (("--resume",), "--record DIR"),
        (("--hardware-config", "cell.yaml"), "is for --station hardware"),
        (("--station", "hardware", "--hidden", "removal"), "--hidden: hardware"),
    ],
)
def test_bad_input_is_one_line(
    arguments: tuple[str, ...], words: str, motion: Path
) -> None:
    run = run_program("play_motion", motion, *arguments)
    assert_one_line(run, [words])
