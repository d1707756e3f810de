"""Stations and simulations, built once for all tests of a process."""

import dataclasses

import pytest

from drake_disasm.scenario import Scenario, load_scenario
from drake_disasm.stations import CellStation, TwinStation

QUIET = "ft_sensor.noise=[0, 0, 0, 0, 0, 0]"
#: A grip that does not yield: a millimetre beside the groove is ten newtons.
STIFF = "gripper.compliance=rigid"


def without_imprecision(scenario: Scenario) -> Scenario:
    """Returns a scenario of which no range draws imprecision: a batch's is another."""
    kept = [r for r in scenario.randomisation if r.parameter != "imprecision"]
    return dataclasses.replace(scenario, randomisation=kept)


@pytest.fixture(scope="session")
def quiet_scenario() -> Scenario:
    """The default scenario without sensor noise."""
    return load_scenario("removal", [QUIET])


@pytest.fixture(scope="session")
def cell(quiet_scenario: Scenario) -> CellStation:
    """The cell without sensor noise."""
    return CellStation(quiet_scenario)


@pytest.fixture(scope="session")
def twin(quiet_scenario: Scenario) -> TwinStation:
    """The twin without sensor noise."""
    return TwinStation(quiet_scenario)
