"""Effects in running episodes, against what their equations say of the observation."""

import numpy as np
import pytest
from pydrake.math import RigidTransform

from drake_disasm import effects as ef
from drake_disasm.common.spatial import (
    pose_from_vector,
    rotation_vector,
    shift_and_express,
    weight_wrench,
)
from drake_disasm.policies import make_policy
from drake_disasm.scenario import load_scenario
from drake_disasm.task.simulation import TaskSimulation
from tests.drake_disasm.conftest import QUIET

COUNTLESS = "ft_sensor.quantum=[0, 0, 0, 0, 0, 0]"
TURN = np.array([0, 0, 0, 0.010, -0.012, 0.015])
BIAS = np.array([0.5, -1.0, 2.0, 0.1, 0.2, -0.3])


@pytest.fixture(scope="module", params=["cell", "twin"])
def simulation(request: pytest.FixtureRequest) -> TaskSimulation:
    """A simulation without noise and counts, open to actions."""
    scenario = load_scenario("removal", [QUIET, COUNTLESS])
    return TaskSimulation(scenario, request.param)


def _turned(
    simulation: TaskSimulation, effects: list[ef.Effect]
) -> tuple[np.ndarray, RigidTransform]:
    """Returns wrench and measured pose at rest, turned by TURN in free air."""
    simulation.reset(0, effects)
    simulation.step(TURN)
    for _ in range(5):
        result = simulation.step(np.zeros(6))
    vector = simulation.evaluate(simulation.systems.processor, "X_GB")
    return result.observation[6:], pose_from_vector(vector)


def _sensor_in_g(simulation: TaskSimulation, X_GB: RigidTransform) -> RigidTransform:
    """Returns orientation of S in G, with So seen from Bo."""
    return RigidTransform(X_GB.rotation()) @ simulation.station.X_SB.inverse()


def test_bias_is_seen_from_the_bolt(simulation: TaskSimulation) -> None:
    without, nominal = _turned(simulation, [])
    biased, X_GB = _turned(simulation, [ef.SensorBias(*BIAS)])
    assert X_GB.IsExactlyEqualTo(nominal)  # the motion is untouched
    expected = shift_and_express(BIAS, _sensor_in_g(simulation, X_GB))
    np.testing.assert_allclose(biased - without, expected, atol=1e-9)


def test_payload_error_shows_once_the_sensor_turns(simulation: TaskSimulation) -> None:
    """Zeroing hides it upright; turned, the weight's change is what is seen."""
    mass, first_moment = 0.4, np.array([0.004, -0.008, 0.05])
    effect = ef.PayloadError(mass, *first_moment)
    without, _ = _turned(simulation, [])
    wrong, X_GB = _turned(simulation, [effect])
    X_GS = _sensor_in_g(simulation, X_GB)
    R_WG, g_W = simulation.station.X_WG.rotation(), np.array([0, 0, -9.81])
    R_GS0 = simulation.station.X_SB.rotation().inverse()
    loads = [
        weight_wrench(mass, first_moment / mass, (R_WG @ R).matrix(), g_W)
        for R in (X_GS.rotation(), R_GS0)
    ]
    expected = shift_and_express(loads[0] - loads[1], X_GS)
    assert np.abs(expected).max() > 0.02
    np.testing.assert_allclose(wrong - without, expected, atol=1e-8)


def test_environment_effects_act_in_their_order() -> None:
    station = TaskSimulation(load_scenario("removal"), "twin").station
    context = station.CreateDefaultContext()
    station.set_effects(context, [ef.GroovePose(ry=0.1), ef.GroovePose(x=0.001)])
    expected = [0.001 * np.cos(0.1), 0, -0.001 * np.sin(0.1)]
    X_GnG = station.true_groove_pose(context)
    np.testing.assert_allclose(X_GnG.translation(), expected, atol=1e-15)


def _true_ry(simulation: TaskSimulation) -> float:
    context = simulation.station.GetMyMutableContextFromRoot(simulation.context)
    return rotation_vector(simulation.station.true_groove_pose(context).rotation())[1]


def test_effects_are_of_one_episode_as_they_are_at_its_reset() -> None:
    """As an optimiser does that writes its parameters into the same objects."""
    simulation = TaskSimulation(load_scenario("removal_turned"), "twin")
    simulation.reset(0)
    simulation.scenario.effects[0].ry = -0.03
    simulation.reset(0)
    assert _true_ry(simulation) == pytest.approx(-0.03)
    effect = ef.GroovePose(ry=0.01)
    simulation.reset(0, [effect])
    effect.ry = 0.02
    simulation.reset(0, [effect])
    assert _true_ry(simulation) == pytest.approx(0.02)
    simulation = TaskSimulation(
        load_scenario("removal"), "twin", make_policy("straight")
    )
    first = simulation.reset(1)
    simulation.reset(1, [ef.GroovePose(ry=0.05), ef.SensorBias(fx=1.0)])
    assert _true_ry(simulation) == pytest.approx(0.05)
    np.testing.assert_array_equal(simulation.reset(1), first)
    assert _true_ry(simulation) == 0.0
