"""What pays more than the task itself would be learned in its place."""

import numpy as np
import pytest

from drake_disasm.mdp import Outcome
from drake_disasm.policies import make_policy
from drake_disasm.scenario import load_scenario
from drake_disasm.task.episode import EpisodeSummary, run_episode
from drake_disasm.task.simulation import TaskSimulation

SCENARIO = load_scenario("removal")
OUT = SCENARIO.lock.lift_needed(SCENARIO.task.lift_success)
HOVER = OUT - 0.001  # m, just below the height that counts as out


class Cheat:
    """Removes the bolt honestly up to just below success, then does something else.

    Args:
        then: gives the action (6,) for a height [m], step by step.
    """

    def __init__(self, then: str) -> None:
        self._honest, self._then = make_policy("admittance"), then
        self._steps = 0

    def __call__(self, observation: np.ndarray) -> np.ndarray:
        """Returns the action (6,) for an observation (12,)."""
        y = observation[1]
        if y < HOVER - 0.0003 and not self._steps:
            action = self._honest(observation)
            action[1] = min(action[1], 0.0004)
            return action
        self._steps += 1
        if self._then == "fly on":
            return np.array([0.003, 0.2 * (HOVER - y), 0.0, 0.0, 0.0, 0.0])
        sign = -1.0 if self._steps % 2 else 1.0
        return np.array([0.0, sign * 0.003, 0.0, 0.0, 0.0, 0.0])


def _episode(policy: object, seed: int = 1) -> EpisodeSummary:
    return run_episode(TaskSimulation(SCENARIO, "twin", policy), seed)


@pytest.mark.parametrize(
    ("then", "end"),
    [("fly on", Outcome.WORKSPACE), ("up and down", Outcome.STEP_LIMIT)],
)
def test_cheating_pays_less_than_removing_the_bolt(then: str, end: Outcome) -> None:
    """Before: 183 for flying on, 213 for going up and down, 132 for the task."""
    honest, cheat = _episode(make_policy("admittance")), _episode(Cheat(then))
    assert honest.outcome is Outcome.SUCCESS and cheat.outcome is end
    assert cheat.reward < honest.reward
