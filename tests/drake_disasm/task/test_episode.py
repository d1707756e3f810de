"""An episode's summary and table, by hand."""

import dataclasses

import numpy as np
import pytest

from drake_disasm.common.errors import DivergedError, UnreachableError
from drake_disasm.mdp import Outcome
from drake_disasm.policies import make_policy
from drake_disasm.scenario import load_scenario
from drake_disasm.task.episode import EpisodeSummary, run_episode, summary_table
from drake_disasm.task.simulation import StepResult, TaskSimulation


def _result(
    p_mm: list[float], f: list[float], t: float, outcome: Outcome = Outcome.RUNNING
) -> StepResult:
    place = np.array(p_mm) / 1e3
    hand = place + np.array([0.001, 0.001, 0.0])  # the grip has given
    observation = np.concatenate([hand, np.zeros(3), f, [0, 0, t]])
    terms = {"progress": p_mm[0], "force": -1.0, "torque": -0.5, "lift": 0.0}
    return StepResult(observation, place, terms, outcome)


@pytest.fixture
def summary() -> EpisodeSummary:
    summary = EpisodeSummary(seed=7)
    summary.add(_result([1, 0, 0], [3, 4, 0], 0.1))
    summary.add(_result([5, 2, 0], [0, 0, -1], -0.4))
    summary.add(_result([2, 1, 0], [0, 24, 7], 0.2, Outcome.FORCE_LIMIT))
    return summary


def test_terms_add_up_by_name_and_values_are_greatest_and_mean(
    summary: EpisodeSummary,
) -> None:
    expected = {"progress": 8.0, "force": -3.0, "torque": -1.5, "lift": 0.0}
    assert summary.reward_terms == pytest.approx(expected)
    assert summary.reward == pytest.approx(3.5)
    assert (summary.steps, summary.outcome) == (3, Outcome.FORCE_LIMIT)
    assert (summary.travel, summary.rise) == pytest.approx((0.005, 0.002))
    assert (summary.max_force, summary.max_torque) == pytest.approx((25.0, 0.4))
    assert summary.mean_force == pytest.approx((5 + 1 + 25) / 3)
    assert _result([3, 0, 0], [0, 0, 0], 0.0).reward == pytest.approx(1.5)
    header, units, row, total = summary_table([summary]).splitlines()
    assert "outcome" in header and "mm" in units
    assert row.split()[:4] == ["0", "7", "3", "3.50"]
    assert row.endswith("force limit")
    assert total == "0 of 1 episodes succeeded"
    other = dataclasses.replace(summary, outcome=Outcome.SUCCESS)
    table = summary_table([summary, other]).splitlines()
    assert len(table) == 5 and table[3].endswith("success")
    assert table[-1] == "1 of 2 episodes succeeded"
    summary.bolt_is_out = True
    assert "(the bolt is out)" in summary_table([summary])


@pytest.mark.parametrize("failure", [UnreachableError, DivergedError])
def test_a_policy_that_leads_beyond_what_there_is_has_left_the_workspace(
    failure, monkeypatch
):
    scenario = load_scenario("removal")
    simulation = TaskSimulation(scenario, "twin", make_policy("straight", scenario))
    step, steps = simulation.step, iter(range(10))

    def third_is_too_far() -> StepResult:
        if next(steps) == 2:
            raise failure("too far")
        return step()

    monkeypatch.setattr(simulation, "step", third_is_too_far)
    summary = run_episode(simulation, 0, is_judged=True)
    assert (summary.outcome, summary.steps) == (Outcome.WORKSPACE, 2)
    steps = iter(range(10))
    with pytest.raises(failure):
        run_episode(simulation, 0)


@pytest.mark.parametrize("contact", ["hydroelastic", "impact"])
def test_a_simulation_that_diverges_says_so_and_may_be_reset(contact: str) -> None:
    scenario = load_scenario("removal", [f"contact.model={contact}"])
    simulation = TaskSimulation(scenario, "twin", make_policy("straight", scenario))
    simulation.reset(0)
    plant = simulation.station.plant
    context = plant.GetMyMutableContextFromRoot(simulation.context)
    plant.SetVelocities(context, np.full(plant.num_velocities(), 1e200))
    with pytest.raises(DivergedError, match=r"twin has diverged before 0\.1"):
        simulation.step()
    simulation.reset(0)
    assert np.isfinite(simulation.step().observation).all()
