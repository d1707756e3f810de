"""One agent that learns on several tasks at a time."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from drake_disasm.common.progress import ignore_progress
from drake_disasm.learning.environments import make_environments
from drake_disasm.learning.experiment import Experiment
from drake_disasm.learning.hyperparameters import Hyperparameters, preset
from drake_disasm.learning.jobs import seed_jobs, train_seeds
from drake_disasm.learning.loop import TrainingLoop
from drake_disasm.learning.run import read_episodes
from drake_disasm.learning.training import TrainingSpec, make_training
from drake_disasm.policies import load_policy
from drake_disasm.scenario import Scenario, load_scenario
from tests.refusals import refused

_SHORT = ["task.steps=3"]
PEG = load_scenario("iiwa_peg", _SHORT)
BAYONET = load_scenario("iiwa_bayonet", _SHORT)


def _config(**changes: object) -> Hyperparameters:
    small = {"hidden": [8], "batch": 16, "episodes": 4, "axes": "stage"} | changes
    return dataclasses.replace(preset("best", "sac"), **small)


def _spec(scenario: Scenario, *others: Scenario, envs: int = 1) -> TrainingSpec:
    config = _config()
    return TrainingSpec(
        scenario, "twin", config, 3, compiled=False, envs=envs, others=others
    )


def test_each_row_is_as_in_a_batch_of_its_task_alone() -> None:
    """Two trainings, of two rows for each of two tasks."""
    specs = [_spec(PEG, BAYONET, envs=2), _spec(PEG, BAYONET, envs=2)]
    together = make_environments(specs)
    alone = [make_environments([_spec(task, envs=4)]) for task in (PEG, BAYONET)]
    rows = [np.array([0, 1, 4, 5]), np.array([2, 3, 6, 7])]
    seeds = np.arange(8) + 70
    seen = together.begin(np.arange(8), seeds.tolist())
    for own, environments in zip(rows, alone, strict=True):
        begun = environments.begin(np.arange(4), seeds[own].tolist())
        np.testing.assert_array_equal(seen[own], begun)
    actions = np.random.default_rng(0).uniform(-1e-4, 1e-4, (8, 6))
    step = together.step(actions)
    is_out = together.bolt_is_out()
    for own, environments in zip(rows, alone, strict=True):
        expected = environments.step(actions[own])
        np.testing.assert_array_equal(step.seen[own], expected.seen)
        np.testing.assert_array_equal(step.reward[own], expected.reward)
        np.testing.assert_array_equal(step.outcome[own], expected.outcome)
        np.testing.assert_array_equal(is_out[own], environments.bolt_is_out())
        recorded = environments.recorded(3, 1)
        assert recorded is not None
        for name, values in (together.recorded(int(own[3]), 1) or {}).items():
            np.testing.assert_array_equal(values, recorded[name])
    again = together.begin(np.array([6]), [1])
    np.testing.assert_array_equal(again[:6], step.seen[:6])


@pytest.mark.parametrize("envs", [1, 2])
def test_an_agent_remembers_as_many_episodes_of_each(envs: int) -> None:
    spec = _spec(PEG, BAYONET, envs=envs)
    training = make_training(spec)
    loop = TrainingLoop(make_environments([spec]), [training])
    loop.run_round()
    assert [summary.steps for summary in training.summaries] == [3] * (2 * envs)
    assert training.replay.size == 6 * envs
    rows = training.replay.contents()[0].reshape(3, 2 * envs, -1)
    left = rows[:, :, 3] * spec.config.rotation_scale  # of a turn
    assert (np.abs(left[:, :envs]) < 0.01).all()  # pegs don't turn
    np.testing.assert_allclose(left[:, envs:], BAYONET.part.stages[0].end, atol=0.05)


@pytest.mark.parametrize("episodes", [1, 3])
def test_a_last_round_may_leave_tasks_out(episodes: int) -> None:
    spec = _spec(PEG, BAYONET)
    config = dataclasses.replace(spec.config, episodes=episodes)
    spec = dataclasses.replace(spec, config=config)
    training = make_training(spec)
    loop = TrainingLoop(make_environments([spec]), [training])
    while loop.unfinished:
        loop.run_round()
    assert len(training.summaries) == episodes
    assert training.replay.size == 3 * episodes


def test_seeds_train_side_by_side_and_are_validated_on_each_task(
    tmp_path: Path,
) -> None:
    experiment = Experiment(
        PEG,
        "twin",
        "best",
        _config(),
        compiled=False,
        validation=1,
        lockstep=True,
        others=(BAYONET,),
    )
    jobs = seed_jobs(experiment, range(2), tmp_path)
    train_seeds(jobs, 1, ignore_progress)
    for job in jobs:
        assert len(read_episodes(job.folder / "episodes.csv")) == 4
        policy = load_policy(job.folder / "policy.npz")
        assert policy.description.evaluation["episodes"] == 2


def test_tasks_that_one_agent_cannot_learn_are_refused() -> None:
    parts = (PEG, "twin", "best")
    with refused("vy and y", "axes=stage"):
        Experiment(*parts, _config(axes="groove"), others=(BAYONET,))
    slow = load_scenario("iiwa_bayonet", ["task.period=0.2"])
    with refused("'iiwa_bayonet'", "task.period 0.2", "0.1"):
        Experiment(*parts, _config(), others=(slow,))
    with refused("also", "logs"):
        Experiment(*parts, _config(), others=(BAYONET,), logs={"log": "0"})
