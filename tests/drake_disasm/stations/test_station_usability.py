"""What a user's own diagram meets: how a station is asked for, and its ports."""

from pathlib import Path

import numpy as np
import pytest
from pydrake.lcm import DrakeLcm
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce
from pydrake.multibody.tree import JacobianWrtVariable
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context

from drake_disasm.scenario import dump_scenario, load_scenario
from drake_disasm.stations import (
    STATIONS,
    CellStation,
    SimulatedStation,
    Station,
    make_station,
)
from drake_disasm.stations.hardware_config import HardwareConfig
from drake_disasm.task.simulation import TaskSimulation
from tests.refusals import refused


@pytest.fixture(scope="module")
def hardware() -> Station:
    return make_station(
        "hardware", "removal", config=HardwareConfig(), lcm=DrakeLcm("memq://")
    )


@pytest.fixture
def station(request: pytest.FixtureRequest) -> Station:
    return request.getfixturevalue(request.param)


def test_a_scenario_is_given_by_name_by_file_or_as_an_object(tmp_path: Path) -> None:
    expected = load_scenario("sliding_randomised", ["part.clearance=0.0003"])
    file = tmp_path / "own.yaml"
    file.write_text(dump_scenario(expected))
    for given in (str(file), file, expected):
        assert make_station("twin", given).scenario == expected
    assert make_station("twin", "removal").scenario == load_scenario("removal")
    assert TaskSimulation("removal", "twin").scenario == load_scenario("removal")


def test_what_is_no_scenario_or_no_station_is_named() -> None:
    with refused("scenario", "removl", "removal"):
        make_station("cell", "removl")
    with refused("scenario", "dict", "give a Scenario"):
        make_station("cell", {"name": "removal"})


@pytest.mark.parametrize("station", STATIONS, indirect=True)
def test_a_port_that_is_missing_is_refused_with_those_that_are_there(station):
    inputs = {port.name for port in station.table if port.is_input}
    outputs = {port.name for port in station.table if not port.is_input}
    with refused(f"{station.kind} has no output 'arm.temperature'", *outputs):
        station.GetOutputPort("arm.temperature")
    with refused(f"{station.kind} has no input 'arm.temperature'", *inputs):
        station.GetInputPort("arm.temperature")
    if station.kind == "hardware":
        words = ("'contact_results'", "only in simulation", *station.simulation_only)
        with refused(*words):
            station.GetOutputPort("contact_results")
    if station.kind == "twin":
        with refused("bolt.positon", "did you mean 'bolt.position'?"):
            station.GetInputPort("bolt.positon")


def _pulled(station: SimulatedStation, body: str, f_W: np.ndarray) -> Context:
    """Returns the station's Context half a second after a force (3,) began [N]."""
    simulator = Simulator(station)
    context = simulator.get_mutable_context()
    commands = {f"{station.arm}.position": station.start}
    if station.grip_command is not None:
        commands["gripper.position"] = [station.grip_command]
    for port, value in commands.items():
        station.GetInputPort(port).FixValue(context, value)
    force = ExternallyAppliedSpatialForce()
    force.body_index = station.plant.GetBodyByName(body).index()
    force.F_Bq_W = SpatialForce(tau=np.zeros(3), f=f_W)
    station.GetInputPort("applied_spatial_force").FixValue(context, [force])
    simulator.AdvanceTo(0.5)
    return context


def test_drives_carry_a_force_on_a_link_of_the_arm(cell: CellStation) -> None:
    """At rest their torques change by -J^T f."""
    plant, f_W = cell.plant, np.array([5.0, 0.0, 0.0])
    rest, pulled = (
        cell.GetOutputPort("iiwa.torque_measured").Eval(_pulled(cell, "iiwa_link_4", f))
        for f in (np.zeros(3), f_W)
    )
    context = cell.part_context(plant, cell.CreateDefaultContext())
    world, link = plant.world_frame(), plant.GetFrameByName("iiwa_link_4")
    J = plant.CalcJacobianTranslationalVelocity(
        context, JacobianWrtVariable.kV, link, np.zeros(3), world, world
    )
    start = plant.GetJointByName("iiwa_joint_1").velocity_start()
    expected = -J[:, start : start + 7].T @ f_W
    np.testing.assert_allclose(pulled - rest, expected, atol=0.05)
    assert abs(expected[1]) > 1.5  # N m


@pytest.mark.parametrize("station", ["cell", "twin"], indirect=True)
def test_the_sensor_reads_a_pull_on_the_bolt(station: SimulatedStation) -> None:
    """Along the groove, where friction alone holds the bolt."""
    f_G = np.array([5.0, 0.0, 0.0])
    rest, pulled = (
        station.GetOutputPort("ft_sensor.wrench").Eval(_pulled(station, "bolt", f_W))
        for f_W in (np.zeros(3), station.X_WG.rotation() @ f_G)
    )
    felt = station.X_SB.rotation().inverse() @ (pulled - rest)[:3]
    np.testing.assert_allclose(felt, f_G, atol=0.3)
