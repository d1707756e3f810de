"""A tool that has nothing to close, and what hangs on it."""

import numpy as np
import pytest
from pydrake.common.value import Value
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.plant import ExternallyAppliedSpatialForce

from drake_disasm.cell.tool import Tool
from drake_disasm.mdp import Outcome
from drake_disasm.policies import make_policy
from drake_disasm.scenario import load_scenario
from drake_disasm.stations import SimulatedStation, make_station
from drake_disasm.stations.hardware import HardwareStation
from drake_disasm.stations.hardware_config import HardwareConfig
from drake_disasm.stations.measured_cell import MeasuredCell
from drake_disasm.task.episode import run_episode
from drake_disasm.task.simulation import TaskSimulation
from tests.drake_disasm.conftest import QUIET
from tests.refusals import refused

SUCTION = "iiwa_peg_suction"


@pytest.fixture(scope="module", params=["cell", "twin"])
def station(request: pytest.FixtureRequest) -> SimulatedStation:
    return make_station(request.param, load_scenario(SUCTION, [QUIET]))


def test_the_peg_rests_at_the_start_and_is_weighed(station: SimulatedStation) -> None:
    """Sensor 0.347 kg, cup 0.2 kg, peg 0.2 kg; on the twin's springs the peg alone."""
    mass = 0.747 if station.kind == "cell" else 0.2
    reading = station.initial_state.reading
    np.testing.assert_allclose(reading[:3], [0, 0, mass * 9.81], atol=0.02)
    context = station.CreateDefaultContext()
    X_GB = station.GetOutputPort("bolt_pose").Eval(context)
    assert np.linalg.norm(X_GB.translation()) < 2e-5


def test_a_pull_stretches_the_springs_and_is_read(station: SimulatedStation) -> None:
    """2 N along y: 0.5 mm of a spring of 4000 N/m, which no encoder sees."""
    simulator = station.at_start([])
    context = simulator.get_mutable_context()
    pull = ExternallyAppliedSpatialForce()
    pull.body_index = station.lock.bolt.index()
    up_W = station.X_WG.rotation() @ np.array([0.0, 2.0, 0.0])
    pull.F_Bq_W = SpatialForce(tau=np.zeros(3), f=up_W)
    port = station.GetInputPort("applied_spatial_force")
    port.FixValue(context, Value[list[ExternallyAppliedSpatialForce]]([pull]))
    simulator.Initialize()
    simulator.AdvanceTo(1.0)
    q = station.GetOutputPort(f"{station.arm}.position_measured").Eval(context)
    truth = station.GetOutputPort("bolt_pose").Eval(context).translation()
    given = truth - station.coordinates.pose(q).translation()
    np.testing.assert_allclose(given, [0.0, 0.0005, 0.0], atol=2e-5)
    before = station.initial_state.reading
    change = station.GetOutputPort("ft_sensor.wrench").Eval(context) - before
    np.testing.assert_allclose(change[:3], [0.0, 0.0, -2.0], atol=0.02)


def test_it_has_a_grippers_ports_which_do_nothing() -> None:
    scenario = load_scenario(SUCTION, [QUIET])
    station = make_station("cell", scenario)
    context = station.CreateDefaultContext()  # whose command is not connected
    state = station.GetOutputPort("gripper.state_measured").Eval(context)
    np.testing.assert_array_equal(state, [0.0, 0.0])
    station.GetInputPort("gripper.position").FixValue(context, [0.1])
    assert station.grip_command == 0.0
    assert MeasuredCell(scenario).HasOutputPort("query_object")


@pytest.mark.parametrize("kind", ["cell", "twin"])
@pytest.mark.parametrize("place", ["wrist", "none"])
def test_admittance_pulls_the_peg_out(kind: str, place: str) -> None:
    scenario = load_scenario(SUCTION, [f"ft_sensor.place={place}"])
    simulation = TaskSimulation(scenario, kind, make_policy("admittance", scenario))
    assert run_episode(simulation, 0).outcome is Outcome.SUCCESS


@pytest.mark.parametrize(("overrides", "words"), [
    (["gripper.fingers=[left_finger_joint]"], ["gripper.fingers", "1 given", "none"]),
    (["gripper.fingers=[]"], ["gripper.model", "left_finger_joint", "fixed"]),
    (["gripper.fingers=[]", "gripper.compliance=rigid"], ["gripper.compliance"]),
])  # fmt: skip
def test_what_is_neither_is_refused(overrides: list[str], words: list[str]) -> None:
    with refused(*words):
        Tool.from_models(load_scenario("removal", overrides))


def test_hardware_has_fingers() -> None:
    with refused("gripper.fingers", "two fingers"):
        HardwareStation(load_scenario(SUCTION), HardwareConfig())
