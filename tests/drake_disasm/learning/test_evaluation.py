"""Validation: figures against sums by hand, and the same seeds give the same."""

import numpy as np
import pytest

from drake_disasm.effects import GroovePose
from drake_disasm.learning.evaluation import evaluate, summed_up
from drake_disasm.mdp import Outcome
from drake_disasm.policies import make_policy
from drake_disasm.scenario import load_scenario
from drake_disasm.task.episode import EpisodeSummary
from drake_disasm.task.simulation import TaskSimulation


def _summary(reward: float, outcome: Outcome, force: float) -> EpisodeSummary:
    return EpisodeSummary(
        seed=0,
        steps=10,
        reward_terms={"progress": reward + 1.0, "force": -1.0},
        max_force=2 * force,
        mean_force=force,
        max_torque=0.2,
        mean_torque=0.1,
        outcome=outcome,
        bolt_is_out=outcome is Outcome.SUCCESS,
    )


def test_figures_are_what_they_say() -> None:
    figures = summed_up(
        [
            _summary(10.0, Outcome.SUCCESS, 1.0),
            _summary(20.0, Outcome.SUCCESS, 2.0),
            _summary(-6.0, Outcome.FORCE_LIMIT, 6.0),
        ]
    )
    assert (figures.episodes, figures.successes, figures.truly_out) == (3, 2, 2)
    assert figures.performance == pytest.approx(8.0)
    assert figures.instability == pytest.approx(np.std([10.0, 20.0, -6.0]))
    assert figures.mean_force == pytest.approx(3.0)
    assert figures.peak_force == 12.0 and figures.mean_peak_force == pytest.approx(6.0)
    assert figures.mean_torque == pytest.approx(0.1)
    assert figures.success_low < 2 / 3 < figures.success_high


def test_the_same_seeds_give_the_same_episodes_and_effects_count() -> None:
    scenario = load_scenario("removal", ["task.steps=8"])
    simulation = TaskSimulation(scenario, "twin", make_policy("straight"))
    first = evaluate(simulation, [3, 4])
    assert evaluate(simulation, [3, 4]) == first
    turned = evaluate(simulation, [3, 4], effects=[GroovePose(ry=0.1)])
    assert turned[0].mean_force > first[0].mean_force
