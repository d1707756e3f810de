"""Transitions of recorded episodes, in an agent's replay memory."""

import numpy as np

from drake_disasm.learning.replay import Replay
from drake_disasm.mdp import BoltState, TaskGeometry, reward_terms
from drake_disasm.policies import TaskView
from drake_disasm.scenario import Scenario


def remember(
    replay: Replay,
    observations: np.ndarray,
    actions: np.ndarray,
    terminated: bool,
    scenario: Scenario,
    view: TaskView,
) -> None:
    """Adds one recorded episode to a replay memory.

    The reward is computed anew from the states, so that a log of any origin and
    any reward teaches this task. An action that this agent can't choose (beyond
    its bounds, or its residual's) is cut to the nearest that it can.

    Args:
        replay: the memory.
        observations: (T + 1, 12) states [m, rad, N, N m].
        actions: (T, 6) un-noised actions [m, rad].
        terminated: whether the task itself ended the episode.
        scenario: of the task: defines the reward.
        view: of the agent.
    """
    seen = view.observe(observations)
    before, after = (
        BoltState.from_vector(observations[k:][: len(actions)]) for k in (0, 1)
    )
    terms = reward_terms(before, after, scenario.task, TaskGeometry.of(scenario))
    chosen = view.from_action(observations[:-1], actions)
    ends = np.arange(1, len(actions) + 1) == len(actions)
    replay.add(seen[:-1], chosen, sum(terms.values()), seen[1:], terminated & ends)
