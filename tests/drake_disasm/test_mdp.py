"""Reward and termination against the thesis's equations, and the system of them."""

import dataclasses
import itertools

import numpy as np
import pytest
from pydrake.systems.framework import Context

from drake_disasm.mdp import (
    REWARD_TERMS,
    BoltState,
    Outcome,
    TaskGeometry,
    outcome,
    reward_terms,
)
from drake_disasm.scenario import TaskConfig, load_scenario
from drake_disasm.systems.task_monitor import TaskMonitor

GEOMETRY = TaskGeometry(
    way="xy",
    ends=(0.0605, 0.007),
    radii=(1.0, 1.0),
    low=np.array([-0.01, -0.01, -0.01]),
    high=np.array([0.07, 0.02, 0.01]),
    compliance=np.zeros((3, 6)),
    turning=np.zeros((3, 6)),
)


def _state(x_mm: float = 0, y_mm: float = 0, f: float = 0, t: float = 0) -> BoltState:
    p = np.array([x_mm, y_mm, 0.0]) / 1000
    return BoltState(p, np.zeros(3), np.array([0, f, 0]), np.array([0, 0, t]))


@pytest.fixture(scope="module", params=["chapter3", "removal"])
def task(request: pytest.FixtureRequest) -> TaskConfig:
    """Both chapters' tasks."""
    return load_scenario(request.param).task


def test_progress_force_and_torque(task: TaskConfig) -> None:
    """Equation 3.4."""
    w = task.reward
    terms = reward_terms(
        _state(x_mm=10), _state(x_mm=12.5, f=-3.0, t=0.5), task, GEOMETRY
    )
    assert terms["progress"] == pytest.approx(w.w_dis * 2.5)
    assert terms["force"] == pytest.approx(-w.w_f * 3.0 / w.f_max)
    assert terms["torque"] == pytest.approx(-w.w_t * 0.5 / w.t_max)
    assert terms["lift"] == 0.0


def test_lift_counts_near_the_end_alone_and_falling_takes_it_back() -> None:
    """Equation 4.3: w_y = 5 per mm while x' - x0 > 55 mm and y' > y."""
    task = load_scenario("removal").task
    for x_mm, dy_mm, lift in ((56, 2.0, 10.0), (54, 2.0, 0.0), (56, -2.0, -10.0)):
        states = _state(x_mm, 1.0), _state(x_mm, 1.0 + dy_mm)
        assert reward_terms(*states, task, GEOMETRY)["lift"] == pytest.approx(lift)


def test_no_round_trip_pays() -> None:
    """From anywhere to anywhere and back, in and out of where lifting counts."""
    random = np.random.default_rng(0)
    way = [_state(*random.uniform([40, -5], [80, 20])) for _ in range(20)]
    task = load_scenario("removal").task
    pairs = itertools.pairwise([*way, way[0]])
    terms = [reward_terms(*pair, task, GEOMETRY) for pair in pairs]
    assert sum(t["progress"] for t in terms) == pytest.approx(0.0)
    assert sum(t["lift"] for t in terms) == pytest.approx(0.0)


def test_progress_ends_with_the_groove(task: TaskConfig) -> None:
    terms = reward_terms(_state(60), _state(70), task, GEOMETRY)
    assert terms["progress"] == pytest.approx(task.reward.w_dis * 0.5)


def test_leaving_the_workspace_fails() -> None:
    task = load_scenario("removal").task
    never = dataclasses.replace(GEOMETRY, ends=(0.0605, 1.0))
    for p in (*np.diag(GEOMETRY.low), *np.diag(GEOMETRY.high)):
        before, after = (BoltState(f * p, *np.zeros((3, 3))) for f in (0.99, 1.01))
        assert outcome(before, 5, task, never) is Outcome.RUNNING
        assert outcome(after, 5, task, never) is Outcome.WORKSPACE


def test_the_workspace_follows_the_lock() -> None:
    scenario = load_scenario("removal", ["part.travel=0.1", "task.room=[.01,.02,.03]"])
    geometry = TaskGeometry.of(scenario)
    np.testing.assert_allclose(geometry.low, [-0.01, -0.02, -0.03])
    out = scenario.part.stages[-1].end + 0.002
    np.testing.assert_allclose(geometry.high, [0.1105, out + 0.02, 0.03])


def test_the_numbers_of_outcomes_are_those_of_old_files() -> None:
    names = ("RUNNING", "SUCCESS", "FORCE_LIMIT", "TORQUE_LIMIT", "STEP_LIMIT")
    assert [Outcome[name].value for name in names] == list(range(5))


OUTCOMES = [
    (_state(10), 5, Outcome.RUNNING),
    (_state(10), 150, Outcome.STEP_LIMIT),
    (_state(10, f=31), 5, Outcome.FORCE_LIMIT),
    (_state(10, t=5.1), 5, Outcome.TORQUE_LIMIT),
    (_state(60, 8.1), 100, Outcome.SUCCESS),
    (_state(60, 8.1, f=31), 5, Outcome.FORCE_LIMIT),
]


@pytest.mark.parametrize(("state", "steps", "expected"), OUTCOMES)
def test_outcome(state, steps, expected, task):
    assert outcome(state, steps, task, GEOMETRY) is expected


def test_success_is_travel_or_lift() -> None:
    sliding, removal = load_scenario("chapter3").task, load_scenario("removal").task
    assert outcome(_state(55.1), 5, sliding, GEOMETRY) is Outcome.SUCCESS
    assert outcome(_state(54.9, 8), 5, sliding, GEOMETRY) is Outcome.RUNNING
    assert outcome(_state(60, 6.9), 5, removal, GEOMETRY) is Outcome.RUNNING


def test_removed_is_judged_by_the_bolt_itself_where_it_is_known() -> None:
    task = load_scenario("removal").task
    for seen, true_y, expected in (
        (_state(60, 9.0), 0.0069, Outcome.RUNNING),
        (_state(60, 6.0, f=-5.0), 0.0071, Outcome.SUCCESS),
    ):
        p_GBo = np.array([0.06, true_y, 0.0])
        assert outcome(seen, 5, task, GEOMETRY, p_GBo) is expected


def test_removed_without_the_truth_is_pulled_away_and_free() -> None:
    task = load_scenario("removal").task
    for state, expected in (
        (_state(60, 7.9), Outcome.RUNNING),
        (_state(60, 8.1, f=-2.1), Outcome.RUNNING),
        (_state(60, 8.1, f=-1.9), Outcome.SUCCESS),
    ):
        assert outcome(state, 5, task, GEOMETRY) is expected


def test_one_stage_pays_for_its_own_axis_until_its_end() -> None:
    """A peg that is pulled out along y: what goes beyond its end pays nothing."""
    task = load_scenario("removal").task
    peg = dataclasses.replace(GEOMETRY, way="y", ends=(0.007,), radii=(1.0,))
    terms = reward_terms(_state(3, 1.0), _state(9, 2.5), task, peg)
    assert terms["progress"] == pytest.approx(task.reward.w_dis * 1.5)
    assert terms["lift"] == 0.0
    beyond = reward_terms(_state(0, 6.5), _state(0, 9.0), task, peg)
    assert beyond["progress"] == pytest.approx(task.reward.w_dis * 0.5)


def test_a_turn_counts_at_its_radius_with_the_grip() -> None:
    """About y by 0.1 rad, of which the grip gives 0.02 under 0.2 N m at 10 N m/rad."""
    task = load_scenario("removal").task
    turning = np.zeros((3, 6))
    turning[1, 4] = 0.1
    part = dataclasses.replace(
        GEOMETRY, way="vy", ends=(1.0, 0.007), radii=(0.01, 1.0), turning=turning
    )
    still = BoltState(*np.zeros((4, 3)))
    after = BoltState(
        np.zeros(3), np.array([0, 0.1, 0]), np.zeros(3), np.array([0, -0.2, 0])
    )
    terms = reward_terms(still, after, task, part)
    assert terms["progress"] == pytest.approx(task.reward.w_dis * 10.0 * 0.08)


def test_terminated_and_truncated_are_told_apart() -> None:
    ends = {o: (o.terminated, o.truncated) for o in Outcome}
    assert ends.pop(Outcome.RUNNING) == (False, False)
    assert ends.pop(Outcome.STEP_LIMIT) == (False, True)
    assert set(ends.values()) == {(True, False)}


def test_reward_is_that_of_equation_4_3() -> None:
    """2 mm on and 3 mm up beyond 55 mm, at 8 N and 1 N m."""
    task = load_scenario("removal").task
    terms = reward_terms(_state(56, 1), _state(58, 4, f=8, t=1), task, GEOMETRY)
    expected = {"progress": 1.6 * 2, "force": -0.12, "torque": -0.06, "lift": 5.0 * 3}
    assert terms == pytest.approx(expected)


def test_limits_are_passed_only_when_exceeded(task: TaskConfig) -> None:
    f, t = task.reward.f_max, task.reward.t_max
    assert outcome(_state(f=f, t=t), 5, task, GEOMETRY) is Outcome.RUNNING


def test_state_is_read_in_the_order_of_the_observation() -> None:
    state = BoltState.from_vector(np.arange(12.0))
    np.testing.assert_array_equal(state.p, [0, 1, 2])
    np.testing.assert_array_equal(state.r, [3, 4, 5])
    assert state.force == pytest.approx(np.sqrt(36 + 49 + 64))
    assert state.torque == pytest.approx(np.sqrt(81 + 100 + 121))


# ---- The system that compares an observation with the last one -----------------------


def _monitor() -> tuple[TaskMonitor, Context]:
    monitor = TaskMonitor(TaskConfig(steps=3), GEOMETRY)
    return monitor, monitor.CreateDefaultContext()


def _observe(monitor: TaskMonitor, context: Context, observation: np.ndarray) -> None:
    monitor.GetInputPort("observation").FixValue(context, observation)


def _period(monitor: TaskMonitor, context: Context) -> None:
    values = monitor.EvalUniquePeriodicDiscreteUpdate(context)
    context.get_mutable_discrete_state().SetFrom(values)


def _outcome(monitor: TaskMonitor, context: Context) -> Outcome:
    return Outcome(int(monitor.GetOutputPort("outcome").Eval(context)[0]))


def test_terms_are_those_of_the_last_step_alone() -> None:
    """Of a walk whose forces stay below the limits."""
    monitor, context = _monitor()
    walk = np.random.default_rng(0).uniform(-0.001, 0.001, (8, 12))
    _observe(monitor, context, walk[0])
    for before, after in itertools.pairwise(walk):
        _period(monitor, context)
        _observe(monitor, context, after)
        terms = monitor.GetOutputPort("reward_terms").Eval(context)
        states = map(BoltState.from_vector, (before, after))
        expected = reward_terms(*states, TaskConfig(), GEOMETRY)
        np.testing.assert_array_equal(terms, [expected[n] for n in REWARD_TERMS])


def test_steps_are_counted_and_limited() -> None:
    monitor, context = _monitor()
    _observe(monitor, context, np.zeros(12))
    seen = []
    for _ in range(4):
        seen.append(_outcome(monitor, context))
        _period(monitor, context)
    assert seen == [Outcome.RUNNING] * 3 + [Outcome.STEP_LIMIT]


def test_outcome_follows_the_observation() -> None:
    """Its twelve numbers in their order: x, y, the forces and torques."""
    for index, value, expected in (
        (6, 20.1, Outcome.FORCE_LIMIT),
        (8, -20.1, Outcome.FORCE_LIMIT),
        (11, -5.1, Outcome.TORQUE_LIMIT),
        (1, 0.0081, Outcome.SUCCESS),
        (0, 0.0701, Outcome.WORKSPACE),
        (6, 19.9, Outcome.RUNNING),
    ):
        monitor, context = _monitor()
        _observe(monitor, context, value * np.eye(12)[index])
        assert _outcome(monitor, context) is expected, (index, value)
