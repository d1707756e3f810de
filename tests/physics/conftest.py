"""The cell, built once."""

import pytest
from physics import QUIET

from drake_disasm.scenario import load_scenario
from drake_disasm.stations import CellStation


@pytest.fixture(scope="session")
def cell() -> CellStation:
    """The default cell without sensor noise."""
    return CellStation(load_scenario("removal", [QUIET]))
