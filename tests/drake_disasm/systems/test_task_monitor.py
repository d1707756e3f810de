"""The monitor compares this period's observation with the last one's."""

import itertools

import numpy as np
from pydrake.systems.framework import Context

from drake_disasm.mdp import (
    REWARD_TERMS,
    BoltState,
    Outcome,
    TaskGeometry,
    reward_terms,
)
from drake_disasm.scenario import TaskConfig
from drake_disasm.systems.task_monitor import TaskMonitor

GEOMETRY = TaskGeometry(
    0.007, 0.0605, -0.006 * np.ones(3), 0.066 * np.ones(3), np.zeros((3, 6))
)
TASK = TaskConfig(steps=3)


def _monitor() -> tuple[TaskMonitor, Context]:
    monitor = TaskMonitor(TASK, GEOMETRY)
    return monitor, monitor.CreateDefaultContext()


def _observe(monitor: TaskMonitor, context: Context, observation: np.ndarray) -> None:
    monitor.get_input_port().FixValue(context, observation)


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
        expected = reward_terms(*states, TASK, GEOMETRY)
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
        (1, 0.0071, Outcome.SUCCESS),
        (0, 0.0661, Outcome.WORKSPACE),
        (6, 19.9, Outcome.RUNNING),
    ):
        monitor, context = _monitor()
        _observe(monitor, context, value * np.eye(12)[index])
        assert _outcome(monitor, context) is expected, (index, value)
