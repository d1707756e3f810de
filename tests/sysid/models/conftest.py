"""Logs of a twin, made once for the tests of models."""

from pathlib import Path

import pytest

from drake_disasm.logs import Log
from drake_disasm.policies import Exploring, make_policy
from drake_disasm.scenario import Scenario, load_scenario
from drake_disasm.task.recording import record_transitions
from drake_disasm.task.simulation import TaskSimulation
from tests.drake_disasm.conftest import STIFF


def record(folder: Path, scenario: Scenario, episodes: int) -> Log:
    """Records episodes of the twin with exploration noise."""
    policy = Exploring(make_policy("admittance"), 1.5e-4, 0)
    simulation = TaskSimulation(scenario, "twin", policy)
    transitions = episodes * scenario.task.steps  # too short to end otherwise
    return record_transitions(folder, simulation, transitions)


@pytest.fixture(scope="session")
def turned() -> Scenario:
    """A groove turned by 2 degrees, and short episodes, on the stiff grip."""
    return load_scenario("removal_turned", [STIFF, "task.steps=24"])


@pytest.fixture(scope="session")
def log(turned, tmp_path_factory) -> Log:
    """Three episodes with sensor noise."""
    return record(tmp_path_factory.mktemp("twin") / "log", turned, 3)


@pytest.fixture(scope="session")
def silent_log(turned, tmp_path_factory) -> Log:
    """Two episodes whose sensor neither errs nor rounds."""
    turned.ft_sensor.noise, noise = [0.0] * 6, turned.ft_sensor.noise
    turned.ft_sensor.quantum, quantum = [0.0] * 6, turned.ft_sensor.quantum
    found = record(tmp_path_factory.mktemp("silent") / "log", turned, 2)
    turned.ft_sensor.noise, turned.ft_sensor.quantum = noise, quantum
    return found


@pytest.fixture(scope="session")
def impact() -> Scenario:
    """The thesis's contact in the twin, in a turned groove."""
    overrides = [STIFF, "task.steps=24", "contact.model=impact"]
    return load_scenario("removal_turned", overrides)


@pytest.fixture(scope="session")
def impact_log(impact, tmp_path_factory) -> Log:
    """Two episodes of that twin, with sensor noise."""
    return record(tmp_path_factory.mktemp("impact") / "log", impact, 2)
