"""A measured pose that comes late, in running episodes."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from drake_disasm.common.spatial import pose_from_vector, rotation_vector
from drake_disasm.effects import Effect, PoseDelay, pose_weights, reported_poses
from drake_disasm.scenario import load_scenario
from drake_disasm.stations import make_station
from drake_disasm.task.simulation import TaskSimulation
from tests.drake_disasm.conftest import QUIET
from tests.refusals import refusal

_PERIOD = 0.1  # s
_STEPS = 7


@pytest.fixture(scope="module", params=["cell", "twin"])
def simulation(request: pytest.FixtureRequest) -> TaskSimulation:
    """A simulation without noise, open to actions."""
    scenario = load_scenario("removal", [QUIET])
    assert scenario.task.period == _PERIOD
    return TaskSimulation(scenario, request.param)


def _episode(
    simulation: TaskSimulation, effects: list[Effect]
) -> tuple[np.ndarray, np.ndarray]:
    """Returns measured poses (n, 6) and raw readings (n, 6) of a free motion."""
    systems = simulation.systems
    simulation.reset(0, effects)
    poses, readings = [], []
    for k in range(_STEPS):
        X_GB = pose_from_vector(simulation.evaluate(systems.processor, "X_GB"))
        poses.append([*X_GB.translation(), *rotation_vector(X_GB.rotation())])
        readings.append(simulation.evaluate(systems.station, "ft_sensor.wrench"))
        action = 1e-3 * np.array([1.5 - 0.3 * k, 0.1, 0.2 * k, 2.0, -k, 3.0])
        simulation.step(action)
    return np.array(poses), np.array(readings)


def test_the_pose_is_that_of_a_time_before(simulation: TaskSimulation) -> None:
    """Of a whole number of steps or not, and only in an episode with the effect."""
    poses, readings = _episode(simulation, [])
    late, same = _episode(simulation, [PoseDelay(2 * _PERIOD)])
    assert np.ptp(poses[:, 0]) > 1e-3
    np.testing.assert_allclose(late[3:], poses[1:-2], atol=1e-12)
    np.testing.assert_allclose(late[:3], 0.0, atol=1e-4)
    np.testing.assert_array_equal(same, readings)  # the motion itself is on time
    between, _ = _episode(simulation, [PoseDelay(0.13)])
    expected = 0.7 * poses[2:-1] + 0.3 * poses[1:-2]
    np.testing.assert_allclose(between[3:], expected, atol=1e-12)
    again, _ = _episode(simulation, [PoseDelay(0.0)])
    np.testing.assert_array_equal(again, poses)


def test_the_observation_is_that_of_the_pose(simulation: TaskSimulation) -> None:
    """Position, rotation, and the wrench that is processed by them."""
    late = [PoseDelay(_PERIOD)]
    simulation.reset(0, late)
    before = simulation.step(np.array([0, 0, 0, 0.01, 0, 0])).observation
    simulation.reset(0)
    now = simulation.step(np.array([0, 0, 0, 0.01, 0, 0])).observation
    assert abs(before[3]) < 1e-4 < abs(now[3])
    turned = np.abs(before[6:] - now[6:]).max()
    assert turned > 1e-3  # weight that is not where it is thought to be


def test_weights_are_of_the_two_poses_around_it() -> None:
    np.testing.assert_allclose(PoseDelay(0.13).weights(_PERIOD), [0.0, 0.7, 0.3])
    np.testing.assert_allclose(PoseDelay(0.2).weights(_PERIOD), [0.0, 0.0, 1.0])
    both = [PoseDelay(0.1), PoseDelay(0.05)]
    np.testing.assert_allclose(pose_weights(both, _PERIOD), [0.0, 0.5, 0.5])
    np.testing.assert_array_equal(pose_weights([PoseDelay()], _PERIOD), [1.0])
    path = np.arange(4.0)[:, None] ** 2
    found = reported_poses(path, np.array([0.0, 0.5, 0.5]))
    np.testing.assert_allclose(found[:, 0], [0.0, 0.0, 0.5, 2.5])
    scenario = load_scenario("removal", [QUIET])
    scenario.effects = [PoseDelay(0.2), PoseDelay(0.2)]
    message = refusal(TaskSimulation, scenario, "twin")
    assert "effects: " in message and "more than 0.3 s together" in message


def test_a_station_without_a_task_refuses_it() -> None:
    scenario = load_scenario("removal", [QUIET])
    scenario.effects = [PoseDelay(0.1)]
    builder = DiagramBuilder()
    station = builder.AddSystem(make_station("twin", scenario))
    still = builder.AddSystem(ConstantVectorSource(station.start))
    builder.Connect(still.get_output_port(), station.GetInputPort("bolt.position"))
    message = refusal(Simulator(builder.Build()).Initialize)
    assert "PoseDelay: acts outside the station" in message
