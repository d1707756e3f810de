"""Stations and simulations, built once for all tests of a process."""

import pytest

from drake_disasm.scenario import Scenario, load_scenario
from drake_disasm.stations import CellStation, TwinStation

QUIET = "ft_sensor.noise=[0, 0, 0, 0, 0, 0]"
#: A grip that does not yield: a millimetre beside the groove is ten newtons.
STIFF = "gripper.compliance=rigid"


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
