"""tools/close_loop.py, as a user runs it."""

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from drake_disasm.effects import CommandGain, SensorDrift
from drake_disasm.policies import make_policy
from drake_disasm.scenario import load_scenario
from drake_disasm.task.simulation import TaskSimulation
from sysid.blind.matrix import nominal
from sysid.blind.transitions import transitions_log
from sysid.objective import tempered
from sysid.tracing.pipeline import HUBER
from tests.sysid.tracing.blind import static_log
from tests.tools.programs import ROOT


def program(*arguments: object) -> list[str]:
    """Returns the command."""
    return [sys.executable, str(ROOT / "tools" / "close_loop.py"), *map(str, arguments)]


def run(*arguments: object) -> subprocess.CompletedProcess[str]:
    """Runs the program to its end."""
    return subprocess.run(
        program(*arguments), capture_output=True, text=True, timeout=280
    )


def test_the_tool_writes_a_scenario_and_a_report(tmp_path):
    log = static_log(tmp_path, [SensorDrift], 5.0, seed=2).folder
    out = tmp_path / "out"
    result = run("--log", log, "--out", out, "--workers", "1")
    assert result.returncode == 0, result.stderr
    assert "missing: SensorDrift" in result.stdout
    scenario = load_scenario(str(out / "scenario.yaml"))
    assert any(isinstance(effect, SensorDrift) for effect in scenario.effects)
    assert json.loads((out / "result.json").read_text())["ending"] == "explained"
    page = (out / "report.html").read_text()
    assert "data:image/png" in page and "http://" not in page


def test_transitions_give_a_scenario_that_simulates(tmp_path):
    hidden = [CommandGain(x=0.03)]
    transitions_log(tmp_path / "log", nominal(), hidden, 0, episodes=6, steps=12)
    out = tmp_path / "out"
    result = run("--log", tmp_path / "log", "--out", out, "--workers", "1")
    assert result.returncode == 0, result.stderr
    assert "missing: CommandGain" in result.stdout
    scenario = load_scenario(str(out / "scenario.yaml"))
    assert scenario.effects[0].x == pytest.approx(0.03, rel=0.02)
    simulation = TaskSimulation(scenario, "twin", make_policy("straight"))
    simulation.reset(0)
    assert np.isfinite(simulation.step().observation).all()


def test_refuses_what_is_not_there(tmp_path):
    transitions_log(tmp_path / "log", nominal(), [], 0, episodes=2, steps=12)
    arguments = ("--log", tmp_path / "log", "--out", tmp_path / "out")
    for more, text in (
        (("--held-out", "nothing"), "no such episode"),
        (("--huber", "-1"), "--huber"),
        (("--parameters", "contact.frictoin"), "did you mean"),
    ):
        result = run(*arguments, *more)
        assert result.returncode == 2 and text in result.stderr
        assert result.stderr.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_ctrl_c_leaves_fits_with_which_the_same_command_goes_on(tmp_path):
    hidden = [CommandGain(x=0.03)]
    transitions_log(tmp_path / "log", nominal(), hidden, 0, episodes=6, steps=12)
    out = tmp_path / "out"
    arguments = ("--log", tmp_path / "log", "--out", out, "--workers", "1")
    process = subprocess.Popen(
        program(*arguments), stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    deadline = time.monotonic() + 200
    while len(list(out.glob("fits/*.npz"))) < 2:
        assert time.monotonic() < deadline and process.poll() is None
        time.sleep(0.02)
    os.kill(process.pid, signal.SIGINT)
    _, errors = process.communicate(timeout=100)
    assert process.returncode == 130 and "what was finished is kept" in errors
    assert not (out / "result.json").exists()
    # A fit that is looked up is not written: what was kept shows in what it says.
    first = min(out.glob("fits/*.npz"), key=lambda path: path.stat().st_mtime_ns)
    with np.load(first) as data:
        arrays = dict(data)
    np.savez(first, **arrays | {"residual": 2.0 * arrays["residual"]})
    value = np.sqrt(np.mean(tempered(2.0 * arrays["residual"], HUBER) ** 2))
    again = run(*arguments)
    assert again.returncode == 0, again.stderr
    assert f"objective {value:.4g}; asking" in again.stdout
    assert not (out / "fits").exists()
