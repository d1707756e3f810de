"""What the cell does as its commanded rate changes, and the twin's steps do not."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from drake_disasm.cell.tool import Tool
from drake_disasm.effects import SensorDelay
from drake_disasm.logs import Log
from drake_disasm.scenario import Scenario, load_scenario
from drake_disasm.systems.policy import Policy
from drake_disasm.task.recording import record_transitions
from drake_disasm.task.simulation import TaskSimulation
from sysid.models import twin as twin_module
from sysid.models.rate_response import RateResponse
from sysid.models.twin import TwinModel
from sysid.objective import rms

_SCENARIO = load_scenario("removal")
_STEPS = 40
_NOTHING = RateResponse.of(_SCENARIO, "twin")


def _to_and_fro(action: np.ndarray) -> Policy:
    """Returns a policy that does an action and its opposite, in turns."""
    number = iter(range(10 * _STEPS))
    return lambda _: action * (1.0 if next(number) % 2 else -1.0)


def _recorded(folder: Path, scenario: Scenario, action: np.ndarray) -> Log:
    simulation = TaskSimulation(scenario, "cell", _to_and_fro(action))
    return record_transitions(folder, simulation, _STEPS)


def _residual(log: Log, scenario: Scenario) -> np.ndarray:
    """Returns residuals (rows, channels) in units of what is stated."""
    model = TwinModel([log], scenario, ()).with_begins(np.zeros(0))
    measured = model.measurements
    return (model.predictions(np.zeros(0)) - measured.values) / measured.sigma


def _nothing(*_: object) -> RateResponse:
    return _NOTHING


def test_a_station_that_is_not_the_cell_has_none():
    for response in (_NOTHING, RateResponse.of(_SCENARIO, "hardware")):
        assert not response.swing.any() and not response.lag.any()


def test_the_swing_carries_the_tools_momentum():
    """Along each axis of G; x, y and z of G are -x, -z and -y of S."""
    swing = RateResponse.of(_SCENARIO, "cell").swing
    period = _SCENARIO.task.period / (swing.shape[1] + 1)
    mass = Tool.from_models(_SCENARIO).mass
    for axis, of_S in enumerate((0, 2, 1)):
        impulse = period * swing[axis, :, of_S].sum()
        assert impulse == pytest.approx(mass, rel=0.35)


def test_a_late_sensor_reads_the_swing(tmp_path, monkeypatch):
    scenario = dataclasses.replace(_SCENARIO, effects=[SensorDelay(1.0, 0.08)])
    log = _recorded(tmp_path / "log", scenario, 5e-4 * np.eye(6)[0])
    residual = _residual(log, scenario)
    assert max(map(rms, residual.T)) < 1.3
    monkeypatch.setattr(twin_module.RateResponse, "of", _nothing)
    assert rms(_residual(log, scenario)[:, 6]) > 2.0 * rms(residual[:, 6])


def test_an_arm_that_turns_to_and_fro_is_where_it_is_predicted(tmp_path, monkeypatch):
    log = _recorded(tmp_path / "log", _SCENARIO, 0.009 * np.eye(6)[5])
    residual = _residual(log, _SCENARIO)
    assert max(map(rms, residual[:, :6].T)) < 0.7
    monkeypatch.setattr(twin_module.RateResponse, "of", _nothing)
    assert rms(_residual(log, _SCENARIO)[:, 5]) > 1.5 * rms(residual[:, 5])
