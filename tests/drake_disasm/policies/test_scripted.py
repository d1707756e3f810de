"""The scripted policies, and exploring around them, on hand-made observations."""

import dataclasses

import numpy as np
import pytest
import torch

from drake_disasm.cell.twin_parameters import bolt_stiffness
from drake_disasm.mdp import action_bounds
from drake_disasm.parts import DoorChain
from drake_disasm.policies import SCRIPTED, Admittance, Exploring, Straight, make_policy
from drake_disasm.scenario import TaskConfig, load_scenario
from tests.refusals import refused

PART = DoorChain()


def _observation(y: float = 0.0, **wrench: float) -> np.ndarray:
    names = ("fx", "fy", "fz", "tx", "ty", "tz")
    return np.array([0, y, 0, 0, 0, 0, *(wrench.get(name, 0.0) for name in names)])


@pytest.mark.parametrize("name", SCRIPTED)
def test_rows_are_answered_as_one_by_one(name: str) -> None:
    """Of NumPy to the bit, and as tensors."""
    policy = make_policy(name)
    scale = np.array([1e-3] * 3 + [1e-2] * 3 + [8.0] * 3 + [0.1] * 3)
    rows = scale * np.random.default_rng(1).normal(size=(200, 12))
    expected = np.stack([policy(row) for row in rows])
    np.testing.assert_array_equal(policy(rows), expected)
    tensors = policy(torch.from_numpy(rows))
    np.testing.assert_allclose(tensors.numpy(), expected, rtol=1e-12)


def test_admittance_yields_in_the_direction_of_the_wrench() -> None:
    """Across the motion: the axis that is pushed moves the pushed way, alone."""
    policy = Admittance()
    for index, axis in enumerate(("fy", "fz", "tx", "ty", "tz"), start=1):
        for push in (2.0, -2.0):
            action = policy(_observation(**{axis: push}))
            expected = np.array([policy.speed, 0, 0, 0, 0, 0])
            translates = index < 3
            expected[index] = push * (
                policy.yield_compliance if translates else policy.rotation_compliance
            )
            np.testing.assert_allclose(action, expected, err_msg=axis)


def test_admittance_slows_down_and_stands_still_at_its_push() -> None:
    policy = Admittance()
    np.testing.assert_allclose(policy(_observation()), [policy.speed, 0, 0, 0, 0, 0])
    steps = [policy(_observation(fx=-f))[0] for f in (0.0, 5.0, policy.push, 14.0)]
    assert steps[0] == policy.speed
    assert steps[1] == pytest.approx(policy.push_compliance * (policy.push - 5.0))
    assert steps[2] == pytest.approx(0.0)
    assert steps[3] < 0.0
    # It lifts only when stopped or lifted.
    for fx, y, lifts in ((-5.9, 0, 0), (-6.1, 0, 1), (6.1, 0, 0), (0.0, 0.001, 1)):
        assert (Admittance()(_observation(y, fx=fx))[1] > 0.0) == lifts, (fx, y)


def test_admittance_lifts_with_bounded_force() -> None:
    policy = Admittance()
    up = [policy(_observation(0.001, fy=-f))[1] for f in (0.0, policy.lift, 10.0)]
    assert up[0] == pytest.approx(min(policy.lift_speed, 8.0 * policy.lift_compliance))
    assert up[1] == pytest.approx(0.0)
    assert up[2] < 0.0
    pushed = policy(_observation(0.001, fx=-3.0))  # it does not push on
    assert pushed[0] == pytest.approx(policy.yield_compliance * -3.0)


@pytest.mark.parametrize("name", SCRIPTED)
def test_policies_keep_their_observation_and_unhindered_the_bounds(name: str) -> None:
    observation = np.random.default_rng(0).normal(size=12)
    before = observation.copy()
    make_policy(name)(observation)
    np.testing.assert_array_equal(observation, before)
    action = make_policy(name)(_observation())
    assert action.shape == (6,)
    assert np.all(np.abs(action) <= action_bounds(TaskConfig()))


STIFFNESS = {
    "stiff": np.array([15.8e3, 14.8e3, 13.1e3, 407.0, 282.0, 370.0]),
    "yielding": np.array([539.0, 577.0, 536.0, 9.8, 9.7, 9.7]),
}


@pytest.mark.parametrize("held", STIFFNESS)
def test_gains_follow_from_the_stiffness(held: str) -> None:
    """A step takes back less than a force or torque has, on every axis."""
    k = STIFFNESS[held]
    policy = Admittance.for_stiffness(k, np.zeros(6), PART)
    assert (policy.yield_compliance * k[:3]).max() == pytest.approx(0.4)
    assert (policy.rotation_compliance * k[3:]).max() == pytest.approx(0.6)
    assert policy.speed * k[0] < policy.push + 1.0
    assert policy.stop < policy.push
    # The stiff one's are those that were tuned for it.
    policy = Admittance.for_stiffness(STIFFNESS["stiff"], np.zeros(6), PART)
    tuned, found = dataclasses.asdict(Admittance()), dataclasses.asdict(policy)
    assert found.pop("way") == tuned.pop("way") == "xy"
    assert found == pytest.approx(tuned, rel=0.1)


def test_a_peg_is_pulled_and_yields_to_what_is_across() -> None:
    policy = make_policy("admittance", load_scenario("iiwa_peg"))
    action = policy(_observation(fy=-5.0, fz=-3.0, tx=0.1))
    assert action[1] == policy.speed and action[0] == 0.0
    assert action[2] < 0.0 < action[3]
    stopped = policy(_observation(fy=-policy.push))
    assert stopped[1] == pytest.approx(0.0)


def test_a_bayonet_is_turned_until_it_is_stopped_and_pulled_then() -> None:
    """The detent's torque does not count as the stop."""
    scenario = load_scenario("iiwa_bayonet")
    policy = make_policy("admittance", scenario)
    in_detent = policy(_observation(ty=-scenario.part.detent_torque))
    assert in_detent[4] > 0.0 and in_detent[1] == 0.0
    at_stop = policy(_observation(ty=-policy.push))
    assert at_stop[4] == pytest.approx(0.0) and at_stop[1] == policy.lift_speed


def test_a_bolt_that_is_held_down_is_pushed_on_along_x() -> None:
    """Lifted by its own account, in a softer grip than it knows: still under a lip."""
    policy = Admittance()
    assert policy(_observation(0.004, fy=-policy.lift))[0] > 0.0
    assert policy(_observation(0.004, fy=-0.2 * policy.lift))[0] == 0.0


def test_lifting_begins_with_the_bolt_and_not_with_the_grip() -> None:
    """Up by 3 mm against 1.5 N at 0.6 kN/m, the bolt has risen by 0.5 mm only."""
    policy = Admittance.for_stiffness(
        STIFFNESS["yielding"], np.full(6, 1.0 / 600.0), PART
    )
    assert policy(_observation(0.003, fy=-1.5))[0] == pytest.approx(policy.speed)
    free = policy(_observation(0.003, fy=-0.5))
    assert free[0] == pytest.approx(0.0) and free[1] > 0.0


def test_a_scenario_decides_the_gains() -> None:
    for compliance in ("adaptive", "rigid"):
        scenario = load_scenario("removal", [f"gripper.compliance={compliance}"])
        policy = make_policy("admittance", scenario)
        assert isinstance(policy, Admittance)
        share = policy.yield_compliance * bolt_stiffness(scenario)[:3].max()
        assert share == pytest.approx(0.4)
    with refused("'admitance'", "'admittance'"):
        make_policy("admitance")


def noise(policy: Exploring, steps: int = 2000) -> np.ndarray:
    policy.reset()
    straight = Straight()(np.zeros(12))
    return np.array([policy(np.zeros(12)) - straight for _ in range(steps)])


def test_adds_noise_of_the_given_size():
    drawn = noise(Exploring(Straight(), 2e-4, seed=3))
    np.testing.assert_allclose(drawn[:, :3].std(axis=0), 2e-4, rtol=0.1)
    np.testing.assert_allclose(drawn[:, 3:].std(axis=0), np.deg2rad(0.02), rtol=0.1)
    assert np.abs(drawn.mean(axis=0)).max() < 4e-5


def test_an_episodes_noise_depends_on_its_seed_alone():
    """So a recording that was interrupted goes on as if it had not been."""
    whole = Exploring(Straight(), 1e-4, seed=3)
    first, second = noise(whole, 5), noise(whole, 5)
    again = noise(Exploring(Straight(), 1e-4, seed=4), 5)
    assert second.tobytes() == again.tobytes() != first.tobytes()


def test_resets_the_policy_inside():
    calls = []

    class Resettable(Admittance):
        def reset(self) -> None:
            calls.append(1)

    Exploring(Resettable(), 1e-4, 0).reset()
    assert calls == [1]
    assert Exploring(Straight(), 0.0, 0)(np.zeros(12)) == pytest.approx(
        Straight()(np.zeros(12))
    )
