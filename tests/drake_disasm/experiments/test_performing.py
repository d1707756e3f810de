"""Experiments on a station, and side by side in a batch."""

import dataclasses
import math

import numpy as np
import pytest

from drake_disasm.common.quantity import quantity
from drake_disasm.effects import GroovePose
from drake_disasm.experiments import (
    Experiment,
    Move,
    Performer,
    Plan,
    Presses,
    Rest,
    Return,
    Reversals,
    SlowApproach,
    Strokes,
    TakeOut,
    Wait,
    Weighing,
    register_experiment,
    registered_experiments,
    registry,
)
from drake_disasm.experiments.base import unit
from drake_disasm.experiments.performing import Laboratory, perform_side_by_side
from drake_disasm.mdp import Outcome
from drake_disasm.scenario import load_scenario
from drake_disasm.task.recording import EpisodeRecorder
from drake_disasm.twin.steps import noise_free
from tests.refusals import refused

IMPACT = noise_free(load_scenario("removal", ["contact.model=impact"]))
STILL = np.zeros(12)


def test_a_move_ends_by_steps_or_by_what_resists() -> None:
    move = Move(unit(0, 1e-3), steps=3, effort=5.0)
    held = np.concatenate([np.zeros(6), [-5.0, 9.0, 0, 0, 0, 0]])
    pulled = np.concatenate([np.zeros(6), [5.0, 0, 0, 0, 0, 0]])
    np.testing.assert_array_equal(move.act(STILL, 2), [1e-3, 0, 0, 0, 0, 0])
    assert move.act(STILL, 3) is None and move.act(held, 0) is None
    assert move.act(pulled, 0) is not None


def test_a_return_is_straight_and_no_faster_than_it_may() -> None:
    back = Return((0.0,) * 6, (1e-3,) * 6, steps=9)
    away = np.concatenate([[4e-3, -2e-3, 0, 0, 0, 0], np.zeros(6)])
    np.testing.assert_allclose(back.act(away, 0), [-1e-3, 5e-4, 0, 0, 0, 0])
    near = np.concatenate([[4e-4, 0, 0, 0, 0, 0], np.zeros(6)])
    np.testing.assert_allclose(back.act(near, 0), [-4e-4, 0, 0, 0, 0, 0])
    assert back.act(STILL, 0) is None and back.act(away, 9) is None


def test_phases_follow_each_other_and_then_it_waits() -> None:
    plan = Plan(Rest(), (Move(unit(0, 1.0), 2), Wait(1), Move(unit(1, 1.0), 1)), 0.1)
    performer = Performer(plan)
    moved = [performer(STILL)[:2].tolist() for _ in range(5)]
    assert moved == [[1, 0], [1, 0], [0, 0], [0, 1], [0, 0]]
    assert performer.is_done and plan.most_steps == 4
    performer.reset()
    assert not performer.is_done and performer(STILL)[0] == 1.0


@pytest.mark.parametrize("name", ["removal", "iiwa_peg", "iiwa_bayonet", "plug"])
def test_every_part_has_experiments(name: str) -> None:
    path = "examples/plug/plug.yaml" if name == "plug" else name
    scenario = load_scenario(path)
    plans = [e.plan(scenario) for k in registered_experiments() for e in k.variants()]
    done = {type(plan.experiment).__name__ for plan in plans if plan.phases}
    assert done == {kind.__name__ for kind in registered_experiments()}


def test_side_by_side_is_what_the_diagram_does() -> None:
    """Each in its environment, to the end of each."""
    tilted = dataclasses.replace(IMPACT, effects=[GroovePose(ry=0.01)])
    kinds = (Reversals(times=1), Presses("z", 2.0, 2), SlowApproach(0.5))
    plans = [kind.plan(IMPACT) for kind in kinds]
    table = perform_side_by_side([IMPACT, tilted], plans)
    for scenario, row in zip((IMPACT, tilted), table, strict=True):
        laboratory = Laboratory(scenario, "twin")
        for plan, found in zip(plans, row, strict=True):
            expected = laboratory.perform(plan)
            assert len(found.observations) == len(expected.observations)
            atol = np.repeat([1e-7, 1e-6, 5e-3, 5e-4], 3)
            assert np.all(np.abs(found.observations - expected.observations) < atol)
    assert table[0][1].greatest[0] > 1.9


def test_strokes_come_back_and_a_slow_one_takes_longer() -> None:
    plan = Strokes(way=0.1).plan(IMPACT)
    [[found]] = perform_side_by_side([IMPACT], [plan])
    x = found.observations[:, 0]
    assert x.max() == pytest.approx(0.1 * 0.06, abs=1e-3)
    assert abs(x[-1]) < 1e-4 and found.ended == ""
    assert found.duration < plan.most_steps * plan.period
    below = np.flatnonzero(np.diff((x > 0.003).astype(int)))  # six passages
    assert len(below) == 6 and below[5] - below[4] > 3 * (below[1] - below[0])


def test_weighing_turns_the_part_in_the_open() -> None:
    plan = Weighing(angle=0.1).plan(IMPACT)
    [[found]] = perform_side_by_side([IMPACT], [plan])
    turned = np.abs(found.observations[:, 3:6])
    out = np.argmax(found.observations[:, 1] > 0.016)
    assert np.all(turned[out:].max(axis=0) > 0.09)
    assert np.abs(found.observations[-5:, 6:9]).max() < 0.2  # nothing touches it
    assert found.ended == "" and isinstance(plan.phases[0], TakeOut)


def test_a_limit_ends_it_and_the_log_says_so() -> None:
    scenario = load_scenario("removal", ["contact.model=impact"])
    plan = Plan(Rest(), (Move(unit(1, 1e-3), 200),), 0.1)  # up, against the lips
    laboratory = Laboratory(scenario, "twin")
    recorder = EpisodeRecorder(laboratory.simulation)
    found = laboratory.perform(plan, 0, recorder)
    assert found.ended == Outcome.FORCE_LIMIT.label and found.greatest[0] > 20.0
    columns = recorder.columns()
    assert columns["terminated"].tolist() == [False] * recorder.steps + [True]
    recorder = EpisodeRecorder(laboratory.simulation)
    laboratory.perform(Rest(duration=1.0).plan(scenario), 0, recorder)
    columns = recorder.columns()
    assert columns["truncated"][-1] and not columns["terminated"].any()


def test_own_experiments_and_what_is_wrong_with_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(registry, "_experiments", dict(registry._experiments))

    @dataclasses.dataclass(frozen=True)
    class Nudge(Experiment):
        """A step to the side."""

        size: float = quantity(
            1e-4, "m", "of it", low=0.0, high=1e-3, grid=(1e-4, 2e-4)
        )

        def phases(self, scenario):
            yield Move(unit(2, self.size), 1)

    assert register_experiment(Nudge) in registered_experiments()
    assert [e.size for e in Nudge.variants()] == [1e-4, 2e-4]
    assert math.isclose(Nudge().plan(IMPACT).phases[0].action[2], 1e-4)
    with refused("Nudge.size", "0.1", "0.001"):
        Nudge(0.1).plan(IMPACT)

    @dataclasses.dataclass(frozen=True)
    class Bare(Experiment):
        """Without what it does."""

    with refused("Bare", "phases"):
        register_experiment(Bare)
    with refused("Shove", "does not exist"):
        registry.find_experiment("Shove")
