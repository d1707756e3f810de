"""Every station has the ports of its table."""

import dataclasses
from unittest.mock import Mock

import pytest
from pydrake.math import RigidTransform
from pydrake.systems.framework import System

from drake_disasm.common.ports import (
    CELL_PORTS,
    TWIN_PORTS,
    Port,
    check_ports,
    port_differences,
)
from drake_disasm.stations import CellStation, SimulatedStation
from drake_disasm.visualization import WrenchVisualizer
from tests.refusals import refused

TABLES = {"cell": CELL_PORTS, "twin": TWIN_PORTS}


@pytest.mark.parametrize("name", TABLES)
def test_parity_in_both_directions(name: str, request: pytest.FixtureRequest) -> None:
    station: SimulatedStation = request.getfixturevalue(name)
    assert port_differences(station, TABLES[name]) == []


def test_a_missing_an_extra_and_a_resized_port_are_named(cell: CellStation) -> None:
    first, second, third, *rest = CELL_PORTS
    odd = dataclasses.replace(third, size=3)
    more = dataclasses.replace(first, name="iiwa.jerk")
    words = ("iiwa.jerk is missing", "iiwa.position is extra", "has size 7, not 3")
    with refused(*words):
        check_ports(cell, (second, odd, more, *rest))


@pytest.mark.parametrize("table", TABLES.values(), ids=TABLES)
def test_every_device_has_health_and_time(table: tuple[Port, ...]) -> None:
    names = {port.name for port in table}
    assert len(names) == len(table)
    assert all(port.unit and port.frame for port in table)
    for device in {name.split(".")[0] for name in names}:
        assert {f"{device}.health", f"{device}.time_measured"} <= names
    # What cell and twin both have is declared alike.
    cell = {port.name: port for port in CELL_PORTS}
    shared = [port for port in TWIN_PORTS if port.name in cell]
    assert len(shared) == 3
    assert all(port == cell[port.name] for port in shared)


def test_wrench_visualizer_has_the_ports_it_lists() -> None:
    """The one system that no diagram has without Meshcat."""
    system: System = WrenchVisualizer(Mock(), RigidTransform())
    ports = [system.get_input_port(i) for i in range(system.num_input_ports())]
    assert [port.get_name() for port in ports] == ["observation", "X_GB"]
    assert system.num_output_ports() == 0
