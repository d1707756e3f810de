"""The played cell: it can be jogged, restarted, and is never in haste."""

from collections.abc import Iterator

import numpy as np
import pytest
from drake import lcmt_iiwa_command
from pydrake.lcm import DrakeLcm

from drake_disasm.devices.iiwa import IiwaStatusMonitor, encode_command
from drake_disasm.scenario import load_scenario
from drake_disasm.stations.fake_cell import real_time
from drake_disasm.stations.fake_cell.cell import FakeCell
from drake_disasm.stations.fake_cell.real_time import RealTime
from tests.refusals import refused


@pytest.fixture(scope="module")
def cell() -> Iterator[FakeCell]:
    """One for all tests, in virtual time; each takes it as it is."""
    with FakeCell(load_scenario("removal"), DrakeLcm("memq://")) as cell:
        yield cell


def _monitor(cell: FakeCell) -> IiwaStatusMonitor:
    """Returns what listens to the cell's arm."""
    checked = DrakeLcm("memq://")
    return IiwaStatusMonitor(cell._lcm, checked, "IIWA_STATUS", 0.005, cell.clock)


def test_a_jogged_arm_is_back_at_the_start(cell: FakeCell) -> None:
    start = cell.position_measured().copy()
    for k in range(60):
        if cell.time > 0.25:  # the driver listens
            cell.commanded = cell.station.start + 1e-4 * k
        cell.advance()
    assert np.abs(cell.position_measured() - start).max() > 1e-3
    assert np.linalg.norm(cell.load()) > 0.5
    time = cell.time
    cell.jog_to_start()
    assert np.array_equal(cell.position_measured(), start)
    assert np.linalg.norm(cell.load()) == 0.0
    assert cell.time == time  # the devices' clocks go on
    assert np.array_equal(cell.commanded, cell.station.start)


def test_a_command_of_other_joints_stops_the_driver(cell: FakeCell) -> None:
    cell.jog_to_start()
    cell._lcm.Publish("IIWA_COMMAND", lcmt_iiwa_command().encode())
    with refused("driver stops", "0 joints"):
        cell.advance()


def test_a_driver_that_restarts_is_silent_and_counts_anew(cell: FakeCell) -> None:
    monitor = _monitor(cell)
    for _ in range(5):
        cell.advance()
        cell._lcm.HandleSubscriptions(0)
    cell.restart("iiwa")
    commands, silent = cell.commands, monitor.read()
    cell._lcm.Publish("IIWA_COMMAND", encode_command(cell.station.start, 0.0))
    while cell.time < cell._restarted_at - 0.01:
        cell.send_measurements()
        cell._lcm.HandleSubscriptions(0)
    assert monitor.read().time == silent.time and cell.commands == commands
    for _ in range(5):
        cell.send_measurements()
        cell._lcm.HandleSubscriptions(0)
    assert monitor.read().time == pytest.approx(cell.time)
    assert monitor.read().counters.reconnects == 1


def test_what_a_slow_machine_loses_is_lost(
    cell: FakeCell, monkeypatch: pytest.MonkeyPatch
) -> None:
    now = [50.0]
    monkeypatch.setattr(real_time.time, "monotonic", lambda: now[0])
    slept: list[float] = []

    def sleep(duration: float) -> None:
        slept.append(duration)
        now[0] += duration

    monkeypatch.setattr(real_time.time, "sleep", sleep)
    pace, begun, number = RealTime(cell), cell.time, cell.hex.sequence
    for k in range(20):
        now[0] += 0.0523 if k == 10 else 0.001
        cell.time += cell.station.control_period  # as `advance` does
        pace.keep()
    assert pace.lost == pytest.approx(0.045)
    assert cell.time - begun == pytest.approx(now[0] - 50.0, abs=1e-9)
    assert cell.hex.sequence - number == 9  # of samples that never were
    assert len(slept) == 19 and min(slept) > 0.0015
