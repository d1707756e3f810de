"""Imprecision, pose target and policy as systems of a diagram."""

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw

from drake_disasm.cell.coordinates import BoltCoordinates
from drake_disasm.common.spatial import pose_from_vector, rotation_vector
from drake_disasm.mdp import action_bounds
from drake_disasm.scenario import TaskConfig, load_scenario
from drake_disasm.systems.imprecision import ImprecisionNoise
from drake_disasm.systems.policy import Policy, ask
from drake_disasm.systems.pose_target import PoseTarget, moved
from drake_disasm.task.simulation import TaskSimulation
from tests.refusals import refused

BOUNDS = action_bounds(TaskConfig())
ACTION = np.array([1e-3, -2e-3, 5e-4, 0.01, -0.005, 0.002])


def _executed(psi: float, action: np.ndarray, noise: np.ndarray) -> np.ndarray:
    system = ImprecisionNoise(psi, BOUNDS)
    context = system.CreateDefaultContext()
    system.GetInputPort("action").FixValue(context, action)
    system.GetInputPort("noise").FixValue(context, noise)
    return system.get_output_port().Eval(context)


def test_imprecision_adds_psi_times_noise_to_translations_alone() -> None:
    """And clips at bounds plus psi: algorithm 3.2, step 7."""
    np.testing.assert_array_equal(_executed(0.0, ACTION, np.full(6, 9.0)), ACTION)
    psi, noise = 5e-4, np.array([1.0, -0.5, 0.2, 5.0, 5.0, 5.0])
    expected = ACTION + psi * noise * [1, 1, 1, 0, 0, 0]
    np.testing.assert_allclose(_executed(psi, ACTION, noise), expected, rtol=1e-14)
    for sign in (1.0, -1.0):
        executed = _executed(psi, sign * BOUNDS, sign * np.full(6, 50.0))
        np.testing.assert_allclose(executed[:3], sign * (BOUNDS[:3] + psi))
        np.testing.assert_allclose(executed[3:], sign * BOUNDS[3:])


def test_imprecision_in_the_diagram_has_deviation_psi() -> None:
    psi = 3e-4
    overrides = [f"imprecision={psi}", "task.period=0.02"]
    simulation = TaskSimulation(load_scenario("removal", overrides), "twin")
    executed = []
    for seed in range(5):
        simulation.reset(seed)
        for _ in range(30):
            simulation.step(np.zeros(6))
            target = simulation.systems.pose_target
            executed.append(simulation.evaluate(target, "action_executed"))
    spread = np.array(executed)[:, :3].std(axis=0)
    np.testing.assert_allclose(spread, psi, rtol=0.2)  # 150 samples: 3.5 sigma
    assert np.all(np.array(executed)[:, 3:] == 0.0)


def test_move_turns_about_the_bolt_and_shifts_in_g() -> None:
    X_GB = RigidTransform(RollPitchYaw(0.1, 0.2, 0.3), [0.01, 0.02, 0.03])
    after = moved(X_GB, ACTION)
    np.testing.assert_allclose(after.translation(), [0.011, 0.018, 0.0305])
    turn = after.rotation() @ X_GB.rotation().inverse()
    np.testing.assert_allclose(rotation_vector(turn), ACTION[3:], atol=1e-14)


def test_pose_target_counts_from_the_last_command() -> None:
    system = PoseTarget(BoltCoordinates(), np.zeros(6), 0.1)
    context = system.CreateDefaultContext()
    system.GetInputPort("action").FixValue(context, ACTION)
    X_GB = RigidTransform()
    for _ in range(3):
        before = BoltCoordinates().solve(X_GB, np.zeros(6))
        X_GB = moved(X_GB, ACTION)
        system.ExecuteForcedEvents(context)
        state = context.get_mutable_discrete_state()
        state.SetFrom(system.EvalUniquePeriodicDiscreteUpdate(context))
        after = BoltCoordinates().solve(X_GB, np.zeros(6))
        velocity = system.GetOutputPort("velocity").Eval(context)
        np.testing.assert_allclose(velocity, (after - before) / 0.1, atol=1e-12)
    commanded = pose_from_vector(system.GetOutputPort("X_GB_commanded").Eval(context))
    assert commanded.IsNearlyEqualTo(X_GB, 1e-12)


BAD_POLICIES: dict[str, Policy] = {
    "finite": lambda s: np.full(6, np.nan),
    "shape (5,)": lambda s: np.zeros(5),
    "shape ()": lambda s: np.float64(1.0),  # type: ignore[return-value]
}


def test_actions_are_clipped_and_bad_ones_refused() -> None:
    clipped = ask(lambda s: 9 * BOUNDS, np.zeros(12), BOUNDS)
    np.testing.assert_array_equal(clipped, BOUNDS)
    for words, policy in BAD_POLICIES.items():
        with refused(words):
            ask(policy, np.zeros(12), BOUNDS)
    simulation = TaskSimulation(load_scenario("removal"), "twin", policy)
    simulation.reset(0)
    with refused(words):
        simulation.step()


def test_policy_is_asked_once_per_period_with_the_state_before_it() -> None:
    asked: list[np.ndarray] = []

    def policy(observation: np.ndarray) -> np.ndarray:
        asked.append(observation.copy())
        return ACTION * 0.1

    simulation = TaskSimulation(load_scenario("removal"), "twin", policy)
    seen = [simulation.reset(0)]
    for _ in range(7):
        seen.append(simulation.step().observation)
    np.testing.assert_array_equal(asked, seen[:-1])
