"""The simulated sensor: sign, order, noise, counts, health."""

import numpy as np
import pytest

from drake_disasm.common.ports import Health
from drake_disasm.effects import PayloadError, SensorBias
from drake_disasm.scenario import load_scenario
from drake_disasm.stations import CellStation, SimulatedStation, TwinStation
from drake_disasm.task.simulation import TaskSimulation

RESOLUTION = np.array([0.2, 0.2, 0.8, 0.010, 0.010, 0.002])  # HEX-E, noise-free


@pytest.mark.parametrize("name", ["cell", "twin"])
def test_hanging_tool_reads_its_weight(name: str, request) -> None:
    """S points down at rest, so the weight is along +z_S; no torque about z."""
    station: SimulatedStation = request.getfixturevalue(name)
    reading = station.reading_at_zeroing(station.settled([]))
    expected = np.array([0, 0, station.payload_mass * 9.81, 0, 0, 0])
    assert np.all(np.abs(reading - expected) < RESOLUTION)


def test_no_data_before_the_first_step(cell: CellStation) -> None:
    assert cell.payload_mass == pytest.approx(0.347 + 1.025 + 0.200)
    context = cell.CreateDefaultContext()
    health = cell.GetOutputPort("ft_sensor.health")
    assert health.Eval(context)[0] == Health.NO_DATA
    assert health.Eval(cell.settled([]))[0] == Health.READY


def test_zeroing_sees_a_payload_but_not_a_bias(twin: TwinStation) -> None:
    clean = twin.reading_at_zeroing(twin.settled([]))
    biased = twin.reading_at_zeroing(twin.settled([SensorBias(fx=1.0)]))
    heavier = twin.reading_at_zeroing(twin.settled([PayloadError(mass=0.1)]))
    np.testing.assert_array_equal(biased, clean)
    np.testing.assert_allclose((heavier - clean)[2], 0.1 * 9.81, rtol=1e-6)


def test_noise_is_counted_and_its_channels_are_independent() -> None:
    scenario = load_scenario("removal", ["task.period=0.02"])
    simulation = TaskSimulation(scenario, "twin")
    simulation.reset(0)
    readings = []
    for _ in range(200):
        simulation.step(np.zeros(6))
        readings.append(simulation.evaluate(simulation.station, "ft_sensor.wrench"))
    counts = np.array(readings) / np.array(scenario.ft_sensor.quantum)
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-6)
    correlation = np.corrcoef(np.array(readings).T) - np.eye(6)
    assert np.abs(correlation).max() < 0.35  # five standard errors
