"""The cell and its twin with a UR5e and with a Panda."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from pydrake.math import RigidTransform

from drake_disasm.cell.coordinates import ArmCoordinates
from drake_disasm.cell.placement import nominal_groove_pose
from drake_disasm.cell.tool import Tool
from drake_disasm.common.ports import cell_ports, port_differences
from drake_disasm.effects import JointCoulombFriction, JointViscousFriction
from drake_disasm.mdp import Outcome
from drake_disasm.policies import make_policy
from drake_disasm.scenario import load_scenario
from drake_disasm.stations import CellStation, TwinStation
from drake_disasm.stations.measured_cell import MeasuredCell
from drake_disasm.task.episode import run_episode
from drake_disasm.task.recording import record_transitions
from drake_disasm.task.simulation import TaskSimulation
from tests.refusals import refused

ARMS = {"ur5e": 6, "panda": 7}
#: Joints whose friction the tests add.
ELBOWS = {"ur5e": "elbow_joint", "panda": "panda_joint4"}


@pytest.fixture(scope="module", params=ARMS)
def cell(request: pytest.FixtureRequest) -> CellStation:
    quiet = "ft_sensor.noise=[0, 0, 0, 0, 0, 0]"
    return CellStation(load_scenario(f"{request.param}_removal", [quiet]))


def test_ports_go_by_the_arms_name(cell: CellStation) -> None:
    table = cell_ports(cell.arm, ARMS[cell.arm])
    assert cell.table == table
    assert port_differences(cell, table) == []
    assert len(cell.joints) == len(cell.start) == ARMS[cell.arm]
    view = MeasuredCell(cell.scenario)
    port = view.GetInputPort(f"{cell.arm}.position_measured")
    assert port.size() == ARMS[cell.arm]


def test_the_arm_rests_at_the_start_and_carries_its_tool(cell: CellStation) -> None:
    context = cell.settled([])
    q, torque = (
        cell.GetOutputPort(f"{cell.arm}.{port}").Eval(context)
        for port in ("position_measured", "torque_measured")
    )
    np.testing.assert_allclose(q, cell.start, atol=1e-3)
    plant, plant_context = cell.plant, cell.part_context(cell.plant, context)
    gravity = plant.CalcGravityGeneralizedForces(plant_context)
    expected = -plant.GetVelocitiesFromArray(cell.arm_instance, gravity)
    np.testing.assert_allclose(torque, expected, atol=1.5)  # the bolt is apart
    assert np.abs(torque).max() > 10.0


def test_friction_of_its_joints_costs_torque(cell: CellStation) -> None:
    """At a rate of 0.1 rad/s dry friction is 3 N m, viscous friction 0.5 N m."""
    name = ELBOWS[cell.arm]
    number = cell.joints.index(name)
    joint = cell.plant.GetJointByName(name)
    context, rate = cell.CreateDefaultContext(), 0.1
    effects = [JointCoulombFriction(name, 3.0), JointViscousFriction(name, 5.0)]
    accelerations = []
    for given in ([], effects):
        cell.set_effects(context, given)
        plant_context = cell.part_context(cell.plant, context)
        joint.set_angular_rate(plant_context, rate)
        v = cell.GetOutputPort(f"{cell.arm}.velocity_estimated").Eval(context)
        assert v[number] == rate
        forces = cell.plant.get_applied_generalized_force_input_port()
        applied = forces.Eval(plant_context)[joint.velocity_start()]
        damping = joint.GetDamping(plant_context)
        accelerations.append(applied - damping * rate)
    without, with_friction = accelerations
    assert without - with_friction == pytest.approx(3.5, rel=0.01)


_STRETCHED = "placement.p_WG=[0.82, -0.13, 0.15]"
_ABOVE_ITSELF = "placement.p_WG=[0.05, -0.13, 0.15]"
_BELOW = "placement.p_WG=[0.18, -0.13, -0.4]"
_ELBOW_DOWN = "arm.posture=[-0.5, -0.2, -1.65, 0.28, -1.57, 1.05]"
_TURNED_BACK = "arm.posture=[-0.5, -1.55, 4.0, -1.68, -1.57, 1.05]"


@pytest.mark.parametrize(("override", "words"), [
    (_STRETCHED, ["arm.posture", "nearly singular", "30 are needed", "bent elbow"]),
    (_ABOVE_ITSELF, ["arm.posture", "nearly singular", "placement.p_WG"]),
    (_TURNED_BACK, ["arm.posture", "4 rad of elbow_joint", "-3.14159 to 3.14159"]),
    ("arm.posture=[0, 0]", ["arm.posture", "2 values", "6 joints"]),
    ("placement.p_WG=[1.1, 0, 0.15]", ["can't reach", "placement", "posture"]),
])  # fmt: skip
def test_a_start_that_the_arm_can_not_serve_is_refused(
    override: str, words: list[str]
) -> None:
    with refused(*words):
        TwinStation(load_scenario("ur5e_removal", [override]))


def test_the_posture_picks_the_branch() -> None:
    """Six joints hold the bolt in a few ways; the nearest is taken."""
    back = "arm.posture=[2.9, -1.55, -1.65, -1.68, 1.57, 1.05]"
    starts = []
    for overrides in ([], [back], [_ELBOW_DOWN]):
        scenario = load_scenario("ur5e_removal", overrides)
        tool, X_WG = Tool.from_models(scenario), nominal_groove_pose(scenario.placement)
        arm = ArmCoordinates(scenario.arm, X_WG, tool.X_FB, scenario.task.period)
        start = arm.start(RigidTransform())
        assert arm.pose(start).IsNearlyEqualTo(RigidTransform(), 1e-5)
        assert np.abs(start - scenario.arm.posture).max() < 1.0
        starts.append(start)
    assert np.sign([start[2] for start in starts]).tolist() == [1, -1, -1]
    assert np.sign([start[4] for start in starts]).tolist() == [-1, 1, -1]


@pytest.mark.parametrize(("override", "words"), [
    (_ELBOW_DOWN, ["ur5e::forearm_link and bench::bench", "inside each other"]),
    (_BELOW, ["ur5e::base_link and ur5e::forearm_link", "collision_filter_group"]),
])  # fmt: skip
def test_a_start_in_collision_names_the_bodies(override: str, words: list[str]) -> None:
    with refused("arm.posture: at the start", *words):
        CellStation(load_scenario("ur5e_removal", [override]))


def _success(station: str, arm: str) -> bool:
    scenario = load_scenario(f"{arm}_removal")
    simulation = TaskSimulation(scenario, station, make_policy("admittance"))
    return run_episode(simulation, 0).outcome is Outcome.SUCCESS


@pytest.mark.parametrize("arm", ARMS)
def test_admittance_takes_the_bolt_out_on_the_twin(arm: str) -> None:
    assert _success("twin", arm)


@pytest.mark.slow
@pytest.mark.parametrize("arm", ARMS)
def test_admittance_takes_the_bolt_out_in_the_cell(arm: str) -> None:
    assert _success("cell", arm)


def test_a_log_names_its_joints(cell: CellStation, tmp_path: Path) -> None:
    task = dataclasses.replace(cell.scenario.task, steps=2)
    scenario = dataclasses.replace(cell.scenario, task=task)
    simulation = TaskSimulation(scenario, "cell", make_policy("admittance"))
    log = record_transitions(tmp_path, simulation, 1)
    assert log.header.joints == cell.joints
    assert log.episodes[0]["q"].shape == (3, ARMS[cell.arm])
