"""tools/close_loop.py, as a user runs it."""

import json
import subprocess
import sys

from drake_disasm.effects import SensorDrift
from drake_disasm.policies import make_policy
from drake_disasm.scenario import load_scenario
from drake_disasm.task.simulation import TaskSimulation
from sysid.logs.recording import record_transitions
from tests.sysid.tracing.blind import static_log
from tests.tools.programs import ROOT


def run(*arguments: object) -> subprocess.CompletedProcess[str]:
    """Runs the program to its end."""
    command = [sys.executable, str(ROOT / "tools" / "close_loop.py")]
    return subprocess.run(
        [*command, *map(str, arguments)], capture_output=True, text=True, timeout=280
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


def test_refuses_logs_that_it_cannot_trace_yet(tmp_path):
    scenario = load_scenario("removal", ["task.steps=3"])
    simulation = TaskSimulation(scenario, "twin", make_policy("straight"))
    record_transitions(tmp_path / "log", simulation, 3)
    result = run("--log", tmp_path / "log", "--out", tmp_path / "out")
    assert result.returncode == 2 and "static_wrench and joint_motion" in result.stderr
    assert not (tmp_path / "out").exists()
