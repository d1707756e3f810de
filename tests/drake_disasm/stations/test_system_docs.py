"""No system escapes the port tests, and every block is complete."""

import ast
import inspect
from pathlib import Path
from unittest.mock import Mock

import pytest
import yaml
from pydrake.math import RigidTransform
from pydrake.systems.framework import System

import drake_disasm
from drake_disasm.ports import CELL_PORTS, TWIN_PORTS, Port
from drake_disasm.stations import CellStation, Station, TwinStation
from drake_disasm.visualization import WrenchVisualizer

PACKAGE = Path(inspect.getfile(drake_disasm)).parent
FILES = sorted(PACKAGE.rglob("*.py"))
BASES = {"LeafSystem", "Diagram", "Station", "SimulatedStation"}
ABSTRACT = {"Station", "SimulatedStation"}


def _systems() -> list[ast.ClassDef]:
    """Every concrete system class of the package, by its base's name."""
    return [
        node
        for file in FILES
        for node in ast.walk(ast.parse(file.read_text()))
        if isinstance(node, ast.ClassDef)
        and node.name not in ABSTRACT
        and {getattr(base, "id", "") for base in node.bases} & BASES
    ]


@pytest.mark.parametrize("node", _systems(), ids=lambda node: node.name)
def test_has_a_block_with_its_name(node: ast.ClassDef) -> None:
    doc = ast.get_docstring(node) or ""
    assert doc.count("@system") == doc.count("@endsystem") == 1
    block = yaml.safe_load(doc.split("@system")[1].split("@endsystem")[0])
    assert block["name"] == node.name.lstrip("_")
    assert set(block) <= {"name", "input_ports", "output_ports"}


def test_scan_finds_the_systems() -> None:
    names = {node.name for node in _systems()}
    assert {"CellStation", "TwinStation", "PolicySystem", "WrenchVisualizer"} <= names


def test_wrench_visualizer_has_the_ports_it_lists() -> None:
    """The one system that no diagram has without Meshcat."""
    system: System = WrenchVisualizer(Mock(), RigidTransform())
    inputs = [
        system.get_input_port(i).get_name() for i in range(system.num_input_ports())
    ]
    assert inputs == ["observation", "X_GB"]
    assert system.num_output_ports() == 0


@pytest.mark.parametrize("station", [CellStation, TwinStation])
def test_station_documents_exactly_its_table_and_the_truth(
    station: type[Station],
) -> None:
    doc = station.__doc__ or ""
    block = yaml.safe_load(doc.split("@system")[1].split("@endsystem")[0])
    inputs = {port.name for port in station.table if port.is_input}
    outputs = {port.name for port in station.table if not port.is_input}
    truth = {"bolt_pose", "contact_results", "query_object"}
    assert set(block["input_ports"]) == inputs | {"applied_spatial_force"}
    assert set(block["output_ports"]) == outputs | truth


@pytest.mark.parametrize("table", [CELL_PORTS, TWIN_PORTS])
def test_every_device_has_health_and_time(table: tuple[Port, ...]) -> None:
    names = {port.name for port in table}
    assert len(names) == len(table)
    for device in {name.split(".")[0] for name in names}:
        assert {f"{device}.health", f"{device}.time_measured"} <= names


def test_shared_ports_mean_the_same() -> None:
    """What cell and twin both have is declared alike."""
    cell = {port.name: port for port in CELL_PORTS}
    shared = [port for port in TWIN_PORTS if port.name in cell]
    assert len(shared) == 3
    assert all(port == cell[port.name] for port in shared)
