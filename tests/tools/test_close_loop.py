"""tools/close_loop.py, as a user runs it."""

import json
import subprocess
from pathlib import Path

import numpy as np
import pytest

from drake_disasm.effects import CommandGain, SensorMounting
from drake_disasm.logs import Log, LogWriter, read_log
from drake_disasm.policies import make_policy
from drake_disasm.scenario import load_scenario
from drake_disasm.task.simulation import TaskSimulation
from sysid.objective import pseudo_residual
from sysid.validation.blind_tests import nominal
from sysid.validation.synthetic_logs import transitions_log
from tests.sysid.effect_selection.blind import static_log
from tests.sysid.report.pages import own_part
from tests.tools.inputs import write_slide_log
from tests.tools.programs import assert_one_line, interrupt, run_program, start_program

LIBRARY = (
    "SensorBias", "SensorCrossTalk", "SensorDrift", "SensorMounting", "PayloadError",
    "JointCoulombFriction", "CommandGain",
)  # fmt: skip


def run(*arguments: object) -> subprocess.CompletedProcess[str]:
    """Runs the program to its end."""
    return run_program("close_loop", *arguments)


def test_the_tool_writes_a_scenario_and_a_report(tmp_path):
    log = static_log(tmp_path, [SensorMounting], 5.0, seed=2).folder
    out = tmp_path / "out"
    result = run("--log", log, "--out", out, "--workers", "1")
    assert result.returncode == 0, result.stderr
    scenario = load_scenario(str(out / "scenario.yaml"))
    assert any(isinstance(effect, SensorMounting) for effect in scenario.effects)
    mapping = json.loads((out / "result.json").read_text())
    assert mapping["ending"] == "explained"
    assert mapping["effects"] == ["SensorMounting"] == mapping["ambiguous"]
    assert mapping["text"] in result.stdout
    assert "Measured against predicted" in own_part((out / "report.html").read_text())


def test_the_arm_is_written_back_into_its_urdf(tmp_path):
    log, out = write_slide_log(tmp_path / "log"), tmp_path / "out"
    result = run("--log", log, "--export", "urdf", "sdf", "--out", out, "--workers", 1)
    assert result.returncode == 0, result.stderr
    assert "exported: slide_identified.urdf, slide_identified.sdf" in result.stdout
    mapping = json.loads((out / "result.json").read_text())["export"]
    assert all((out / name).is_file() for name in mapping["files"])
    assert mapping["round_trips"]["urdf"]["share"] < 1e-6
    assert "Robot's files" in own_part((out / "report.html").read_text())


def test_readings_at_rest_have_no_arm_to_export(tmp_path):
    log, out = static_log(tmp_path, [], 0.0, seed=0).folder, tmp_path / "out"
    result = run("--log", log, "--export", "urdf", "--out", out)
    assert_one_line(result, ["export", "no joint torques", "joint_motion"])
    assert not out.exists()


def _spoilt(source: Log, folder: Path, **columns: np.ndarray) -> Path:
    """Writes readings at rest with other columns of the wrench."""
    values = {name: each.copy() for name, each in source.episodes[0].columns.items()}
    values |= {f"wrench.{name}": column for name, column in columns.items()}
    with LogWriter(folder, source.header) as writer:
        writer.write_episode(values)
    return folder


def test_what_has_changed_since_a_reference_is_said(tmp_path):
    for name in ("march", "april"):
        (tmp_path / name).mkdir()
    known = static_log(tmp_path / "march", [], 0.0, seed=1).folder
    newer = static_log(tmp_path / "april", [SensorMounting], 5.0, seed=2).folder
    out = tmp_path / "out"
    result = run("--reference", known, "--log", newer, "--out", out, "--workers", 1)
    assert result.returncode == 0, result.stderr
    mapping = json.loads((out / "result.json").read_text())
    assert mapping["effects"] == ["SensorMounting"]
    assert mapping["reference"]["ending"] == "none"
    assert mapping["text"] in result.stdout
    assert "What has changed" in own_part((out / "report.html").read_text())
    assert (out / "reference.html").is_file()


def test_a_log_is_no_reference_of_its_own(tmp_path):
    log, out = static_log(tmp_path, [], 0.0, seed=1).folder, tmp_path / "out"
    result = run("--reference", log, "--log", log, "--out", out)
    assert_one_line(result, ["is a reference", "name it once"])
    more = ("--reference", tmp_path / "clean", "--log", log, "--held-out", "log")
    assert_one_line(run(*more, "--out", out), ["--held-out", "not with --reference"])
    assert not out.exists()


def test_what_is_wrong_with_the_data_is_said_before_the_fit(tmp_path):
    log = read_log(static_log(tmp_path, [], 0.0, seed=0).folder)
    episode = log.episodes[0]
    fx = episode["wrench.fx"].copy()
    fx[[30, 60]] += 5.0
    spoilt = _spoilt(log, tmp_path / "spikes", fx=fx)
    arguments = ("--log", spoilt, "--workers", "1")
    out = tmp_path / "out"
    result = run(*arguments, "--drop-flagged-rows", "--out", out)
    assert result.returncode == 0, result.stderr
    assert "data: spikes: wrench.fx: 2 of 100 rows" in result.stderr
    assert "spikes/episode_0000 row 30, 60" in result.stderr
    assert "data: 2 of 100 rows are left out" in result.stderr
    assert "outlying" not in result.stdout
    mapping = json.loads((out / "result.json").read_text())
    [found] = mapping["data_findings"]
    assert found["rows"] == {"spikes/episode_0000": [30, 60]}
    assert "<b>spikes</b>" in (out / "report.html").read_text()


def test_data_that_no_fit_makes_sense_of_are_refused_unless_accepted(tmp_path):
    log = read_log(static_log(tmp_path, [], 0.0, seed=0).folder)
    turned = -log.episodes[0]["wrench.fx"]
    spoilt = _spoilt(log, tmp_path / "turned", fx=turned)
    arguments = ("--log", spoilt, "--workers", "1", "--out", tmp_path / "out")
    refused = run(*arguments)
    assert_one_line(refused, ["axes: fx = -fx would explain", "--accept-findings axes"])
    assert not (tmp_path / "out").exists()
    accepted = run(*arguments, "--accept-findings", "axes", "--time-budget", 0.01)
    assert accepted.returncode == 0, accepted.stderr
    assert "data: axes: fx = -fx" in accepted.stderr


def test_a_wrong_name_is_refused_before_any_work(tmp_path, monkeypatch):
    log = static_log(tmp_path, [], 0.0, seed=0).folder

    def model_of(*_):
        raise AssertionError("the names come first")

    monkeypatch.setattr("drake_disasm_cli.close_loop.model_of", model_of)
    arguments = ("--log", log, "--out", tmp_path / "out")
    assert_one_line(run(*arguments, "--held-out", "nothing"), ["no such episode"])
    monkeypatch.undo()
    wrong = run(*arguments, "--parameters", "contact.frictoin")
    assert_one_line(wrong, ["did you mean 'friction'"])
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_transitions_give_a_scenario_that_simulates(tmp_path):
    hidden = [CommandGain(x=0.03)]
    transitions_log(tmp_path / "log", nominal(), hidden, 0, episodes=6, steps=12)
    out = tmp_path / "out"
    result = start_program(
        "close_loop", "--log", tmp_path / "log", "--out", out, "--workers", "1"
    )
    assert result.returncode == 0, result.stderr
    result = json.loads((out / "result.json").read_text())
    assert result["effects"] == ["CommandGain"]
    scenario = load_scenario(str(out / "scenario.yaml"))
    assert scenario.effects[0].x == pytest.approx(0.03, rel=0.02)
    simulation = TaskSimulation(scenario, "twin", make_policy("straight"))
    simulation.reset(0)
    assert np.isfinite(simulation.step().observation).all()


@pytest.mark.slow
def test_ctrl_c_leaves_fits_with_which_the_same_command_goes_on(tmp_path):
    hidden = [CommandGain(x=0.03)]
    transitions_log(tmp_path / "log", nominal(), hidden, 0, episodes=6, steps=12)
    out = tmp_path / "out"
    arguments = ("--log", tmp_path / "log", "--out", out, "--workers", "1")
    interrupt(lambda: len(list(out.glob("fits/*.npz"))) >= 2, "close_loop", *arguments)
    assert not (out / "result.json").exists()
    # A fit that is looked up is not written: what was kept shows in what it says.
    first = min(out.glob("fits/*.npz"), key=lambda path: path.stat().st_mtime_ns)
    with np.load(first) as data:
        arrays = dict(data)
    np.savez(first, **arrays | {"residual": 2.0 * arrays["residual"]})
    value = np.sqrt(
        np.mean(pseudo_residual(2.0 * arrays["residual"], arrays["huber_delta"]) ** 2)
    )
    again = start_program("close_loop", *arguments)
    assert again.returncode == 0, again.stderr
    assert f"without effects: objective {value:.4g}" in again.stdout
    assert not (out / "fits").exists()
