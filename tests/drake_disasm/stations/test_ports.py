"""Every station has the ports of its table, and its docstring lists them."""

import dataclasses

import pytest
import yaml
from pydrake.systems.framework import LeafSystem, System

import drake_disasm
from drake_disasm.common.errors import DisasmError
from drake_disasm.ports import CELL_PORTS, TWIN_PORTS, check_ports, port_differences
from drake_disasm.scenario import load_scenario
from drake_disasm.stations import CellStation, SimulatedStation, TwinStation
from drake_disasm.task.simulation import TaskSimulation

TABLES = {"cell": CELL_PORTS, "twin": TWIN_PORTS}


@pytest.mark.parametrize("name", TABLES)
def test_parity_in_both_directions(name: str, request: pytest.FixtureRequest) -> None:
    station: SimulatedStation = request.getfixturevalue(name)
    assert port_differences(station, TABLES[name]) == []


def test_a_missing_an_extra_and_a_resized_port_are_named(cell: CellStation) -> None:
    first, second, third, *rest = CELL_PORTS
    odd = dataclasses.replace(third, size=3)
    more = dataclasses.replace(first, name="iiwa.jerk")
    with pytest.raises(DisasmError) as caught:
        check_ports(cell, (second, odd, more, *rest))
    for words in (
        "port iiwa.jerk is missing",
        "port iiwa.position is extra",
        "port iiwa.position_commanded has size 7, not 3",
    ):
        assert words in str(caught.value)


@pytest.mark.parametrize("table", TABLES.values())
def test_table_states_unit_and_frame(table: tuple) -> None:
    assert all(port.unit and port.frame and "." in port.name for port in table)


def _documented(system: System) -> tuple[list[str], list[str]]:
    doc = type(system).__doc__ or ""
    block = doc.split("@system")[1].split("@endsystem")[0]
    ports = yaml.safe_load(block)
    return ports.get("input_ports", []), ports.get("output_ports", [])


def _actual(system: System) -> tuple[list[str], list[str]]:
    inputs = [system.get_input_port(i) for i in range(system.num_input_ports())]
    outputs = [system.get_output_port(i) for i in range(system.num_output_ports())]
    return [p.get_name() for p in inputs], [p.get_name() for p in outputs]


def _name(entry: str) -> str:
    return entry.split(" (")[0]


def _is_there(entry: str, real: list[str]) -> bool:
    """Returns whether a listed port is to be there: `name (where ...)` need not be."""
    return " (where " not in entry or _name(entry) in real


@pytest.fixture(scope="module")
def systems() -> list[System]:
    """Each of our systems, in the diagrams that use them."""
    found: list[System] = []
    for model in ("cell", "twin"):
        simulation = TaskSimulation(load_scenario("removal"), model, lambda s: s[:6])
        found += [simulation.station]
        for diagram in (simulation.diagram, simulation.station):
            found += [s for s in diagram.GetSystems() if isinstance(s, LeafSystem)]
    ours = drake_disasm.__name__
    return [s for s in found if type(s).__module__.split(".")[0] == ours]


def test_docstrings_list_the_ports(systems: list[System]) -> None:
    assert {type(s) for s in systems} >= {CellStation, TwinStation}
    assert len({type(s) for s in systems}) >= 9
    for system in systems:
        documented, actual = _documented(system), _actual(system)
        for listed, real in zip(documented, actual, strict=True):
            names = [_name(entry) for entry in listed if _is_there(entry, real)]
            assert sorted(names) == sorted(real), type(system).__name__
