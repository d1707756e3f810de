"""The simulated sensor: sign, order, noise, counts, health."""

import numpy as np
import pytest

from drake_disasm.stations import SimulatedStation

RESOLUTION = np.array([0.2, 0.2, 0.8, 0.010, 0.010, 0.002])  # HEX-E, noise-free


@pytest.mark.parametrize("name", ["cell", "twin"])
def test_hanging_tool_reads_its_weight(name: str, request) -> None:
    """S points down at rest, so the weight is along +z_S; no torque about z."""
    station: SimulatedStation = request.getfixturevalue(name)
    reading = station.reading_at_zeroing(station.settled([]))
    expected = np.array([0, 0, station.payload_mass * 9.81, 0, 0, 0])
    assert np.all(np.abs(reading - expected) < RESOLUTION)
