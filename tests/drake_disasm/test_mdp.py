"""Reward and termination against the thesis's equations, by hand."""

import numpy as np
import pytest

from drake_disasm.mdp import BoltState, Outcome, outcome, reward_terms
from drake_disasm.scenario import TaskConfig, load_scenario

LIFT = 0.007


def _state(x_mm: float = 0, y_mm: float = 0, f: float = 0, t: float = 0) -> BoltState:
    p = np.array([x_mm, y_mm, 0.0]) / 1000
    return BoltState(p, np.zeros(3), np.array([0, f, 0]), np.array([0, 0, t]))


@pytest.fixture(scope="module", params=["sliding", "removal"])
def task(request: pytest.FixtureRequest) -> TaskConfig:
    """Both chapters' tasks."""
    return load_scenario(request.param).task


def test_progress_force_and_torque(task: TaskConfig) -> None:
    w = task.reward
    terms = reward_terms(_state(x_mm=10), _state(x_mm=12.5, f=-3.0, t=0.5), task)
    assert terms["progress"] == pytest.approx(w.w_dis * 2.5)
    assert terms["force"] == pytest.approx(-w.w_f * 3.0 / w.f_max)
    assert terms["torque"] == pytest.approx(-w.w_t * 0.5 / w.t_max)
    assert terms["lift"] == 0.0


@pytest.mark.parametrize(
    ("x_mm", "dy_mm", "lift"), [(56, 2.0, 10.0), (54, 2.0, 0.0), (56, -2.0, 0.0)]
)
def test_lift_counts_upwards_and_near_the_end_alone(
    x_mm: float, dy_mm: float, lift: float
) -> None:
    """Equation 4.3: w_y = 5 per mm while x' - x0 > 55 mm and y' > y."""
    task = load_scenario("removal").task
    terms = reward_terms(_state(x_mm, 1.0), _state(x_mm, 1.0 + dy_mm), task)
    assert terms["lift"] == pytest.approx(lift)


def test_reward_is_that_of_equation_3_4() -> None:
    task = load_scenario("sliding").task
    terms = reward_terms(_state(0), _state(3, f=15, t=2.5), task)
    assert sum(terms.values()) == pytest.approx(0.6 * 3 - 0.2 * 0.5 - 0.2 * 0.5)


OUTCOMES = [
    (_state(10), 5, Outcome.RUNNING),
    (_state(10), 100, Outcome.STEP_LIMIT),
    (_state(10, f=31), 5, Outcome.FORCE_LIMIT),
    (_state(10, t=5.1), 5, Outcome.TORQUE_LIMIT),
    (_state(60, 7.1), 100, Outcome.SUCCESS),
    (_state(60, 7.1, f=31), 5, Outcome.FORCE_LIMIT),
]


@pytest.mark.parametrize(("state", "steps", "expected"), OUTCOMES)
def test_outcome(
    state: BoltState, steps: int, expected: Outcome, task: TaskConfig
) -> None:
    assert outcome(state, steps, task, LIFT) is expected


def test_success_is_travel_or_lift() -> None:
    sliding, removal = load_scenario("sliding").task, load_scenario("removal").task
    assert outcome(_state(55.1), 5, sliding, LIFT) is Outcome.SUCCESS
    assert outcome(_state(54.9, 8), 5, sliding, LIFT) is Outcome.RUNNING
    assert outcome(_state(60, 6.9), 5, removal, LIFT) is Outcome.RUNNING


def test_terminated_and_truncated_are_told_apart() -> None:
    ends = {o: (o.terminated, o.truncated) for o in Outcome}
    assert ends.pop(Outcome.RUNNING) == (False, False)
    assert ends.pop(Outcome.STEP_LIMIT) == (False, True)
    assert set(ends.values()) == {(True, False)}
