"""Training: schedules, what is remembered, and going on bit for bit."""

import dataclasses
import functools
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from drake_disasm.common.errors import DivergedError, UnreachableError
from drake_disasm.common.progress import ProgressUpdate, ignore_progress
from drake_disasm.learning import run
from drake_disasm.learning.actor_critic import ActorCritic
from drake_disasm.learning.dataset import remember
from drake_disasm.learning.environments import DiagramRow
from drake_disasm.learning.evaluation import validate_policy
from drake_disasm.learning.experiment import Experiment
from drake_disasm.learning.hyperparameters import Hyperparameters, preset
from drake_disasm.learning.jobs import seed_jobs, train_seed
from drake_disasm.learning.loop import TrainingLoop
from drake_disasm.learning.networks import q_value
from drake_disasm.learning.policy import trained_policy
from drake_disasm.learning.replay import Replay
from drake_disasm.learning.run import read_episodes
from drake_disasm.learning.training import (
    Training,
    TrainingSpec,
    make_training,
    task_view,
)
from drake_disasm.logs import read_log
from drake_disasm.mdp import action_bounds
from drake_disasm.policies import Admittance, LearnedPolicy, TaskView, make_policy
from drake_disasm.scenario import load_scenario
from drake_disasm.task.episode import EpisodeSummary
from drake_disasm.task.simulation import TaskSimulation
from tests.refusals import refused

SCENARIO = load_scenario("chapter3", ["imprecision=0.0003", "task.steps=6"])


def _training(
    algorithm: str = "ddpg", memories: dict[str, Any] | None = None, **changes: Any
) -> Training:
    small = {"hidden": [8], "batch": 16, "exploration": 0.0003} | changes
    config = dataclasses.replace(preset("chapter3", algorithm), **small)
    return make_training(_spec(config), **(memories or {}))


def _spec(config: Hyperparameters) -> TrainingSpec:
    return TrainingSpec(SCENARIO, "twin", config, seed=5, compiled=False)


@functools.cache
def _diagram() -> DiagramRow:
    return DiagramRow(SCENARIO, "twin")


def _run(training: Training, episodes: int = 1) -> tuple[EpisodeSummary, Any]:
    """Runs episodes on the diagram; returns the last one and its columns."""
    loop = TrainingLoop(_diagram(), [training])
    return [loop.run_round()[0][0] for _ in range(episodes)][-1]


def _bits(training: Training) -> list[np.ndarray]:
    return [*training.agent.arrays().values(), training.replay.contents()[0]]


def _policy(training: Training) -> LearnedPolicy:
    assert isinstance(training.agent, ActorCritic)
    return trained_policy(training.agent.network(), _spec(training.config), {})


def _assert_same_bits(one: Training, other: Training) -> None:
    for a, b in zip(_bits(one), _bits(other), strict=True):
        np.testing.assert_array_equal(a, b)


def _demonstrations(view: TaskView) -> Replay:
    memory = Replay(50)
    observations = np.random.default_rng(0).normal(size=(51, 12)) * 1e-3
    actions = np.zeros((50, 6))
    remember(memory, observations, actions, True, SCENARIO, view)
    return memory


@pytest.mark.parametrize(("algorithm", "changes"), [
    ("ddpg", {"schedule": "every_step", "updates_per_step": 2}),
    ("td3", {"layer_norm": True}),
    ("sac", {"base": "admittance", "adapt_entropy": True}),
])  # fmt: skip
def test_a_restored_training_goes_on_bit_for_bit(algorithm, changes, tmp_path):
    whole, first, second = (_training(algorithm, **changes) for _ in range(3))
    _run(whole, 3)
    _run(first, 2)
    first.save(tmp_path / "c.npz")
    second.restore(tmp_path / "c.npz")
    _run(second)
    assert second.summaries == whole.summaries
    _assert_same_bits(whole, second)
    other = make_training(dataclasses.replace(_spec(whole.config), seed=6))
    assert _run(other)[0] != whole.summaries[0]


def test_the_delayed_schedule_acts_with_one_policy_for_an_episode() -> None:
    """Both schedules begin alike; only `every_step` changes within the episode."""
    actions = {}
    for schedule in ("delayed", "every_step"):
        training = _training(
            schedule=schedule, actor_rate=0.1, batch=4, exploration=1e-5
        )
        _run(training)
        actions[schedule] = training.replay.contents()[0][:, 12:18]
    np.testing.assert_array_equal(actions["delayed"][0], actions["every_step"][0])
    assert not np.array_equal(actions["delayed"][-1], actions["every_step"][-1])


def test_what_is_remembered_is_the_action_before_imprecision() -> None:
    training = _training()
    _, columns = _run(training)
    rows, bounds = training.replay.contents()[0], action_bounds(SCENARIO.task)
    chosen = rows[:, 12:18] * bounds
    np.testing.assert_allclose(chosen, columns["action"][:-1], atol=1e-8)
    assert np.abs(chosen - columns["action_executed"][:-1])[:, :3].max() > 1e-5
    assert columns["truncated"][-1] and not rows[:, -2].any()  # a limit is no end


@pytest.mark.parametrize("failure", [UnreachableError, DivergedError])
def test_a_step_that_the_arm_can_not_do_ends_the_episode_and_not_the_training(
    failure, tmp_path, monkeypatch
):
    """And its log is valid, with the steps that were done."""
    step, steps, bad = TaskSimulation.step, iter(range(100)), [2]

    def one_is_too_far(simulation: Any, action: Any = None) -> Any:
        number = next(steps)
        result = step(simulation, action)
        if number in bad:
            raise failure("too far")
        return result

    monkeypatch.setattr(TaskSimulation, "step", one_is_too_far)
    experiment = Experiment(
        SCENARIO, "twin", "chapter3", _training(episodes=2).config, validation=1
    )
    experiment = dataclasses.replace(experiment, compiled=False)
    [job] = seed_jobs(experiment, [5], tmp_path)
    train_seed(job, ignore_progress)
    first, second = read_episodes(job.folder / "episodes.csv")
    assert (first["outcome"], first["steps"]) == ("workspace", 2)
    assert second["steps"] == 6
    episodes = read_log(job.folder / "log").episodes
    assert [episode.rows for episode in episodes] == [3, 7]
    bad.append(next(steps) + 1)
    with pytest.raises(failure):  # the first step of all: the start is not right
        train_seed(dataclasses.replace(job, folder=tmp_path / "other"), ignore_progress)


def test_progress_goes_on_through_the_greedy_episodes(tmp_path: Path) -> None:
    config = _training(episodes=2).config
    experiment = Experiment(SCENARIO, "twin", "chapter3", config, validation=3)
    [job] = seed_jobs(dataclasses.replace(experiment, compiled=False), [0], tmp_path)
    told: list[ProgressUpdate] = []
    train_seed(job, told.append)
    assert [(u.stage, u.done, u.total) for u in told] == [
        *(("training", done, 2) for done in (1, 2)),
        *(("evaluating", done, 3) for done in (1, 2, 3)),
    ]


def test_exploration_shrinks_by_episode_and_without_it_nothing_is_random() -> None:
    training = _training(exploration=0.003, exploration_decay=0.5)
    assert [training.sigma(n) for n in range(3)] == pytest.approx([1.0, 0.5, 0.25])
    calm = _training(exploration=0.0)
    assert isinstance(calm.agent, ActorCritic)
    seen = np.zeros((1, 12), np.float32)
    chosen = calm.agent.explore(seen, calm.noise(0, 1)(), np.float32(calm.sigma(0)))
    np.testing.assert_array_equal(chosen[0], np.tanh(calm.agent.network()(seen[0])))


def test_a_residual_begins_as_its_base_policy_and_stays_near_it() -> None:
    training = _training("sac", base="admittance", residual=[0.1] * 6)
    base = make_policy("admittance", SCENARIO)
    assert isinstance(base, Admittance)
    policy = _policy(training)
    observation = np.random.default_rng(2).normal(size=12) * 1e-3
    difference = policy(observation) - base(observation)
    bounds = action_bounds(SCENARIO.task)
    assert (np.abs(difference) < 0.01 * bounds).all()
    for sign in (-1.0, 1.0):
        action = training.view.to_action(np.zeros(12), sign * np.ones(6))
        assert (np.abs(action - base(np.zeros(12))) <= 0.1 * bounds + 1e-12).all()


def test_corrections_are_as_long_whatever_the_bounds() -> None:
    for bound, limit in ((0.003, 9e-4), (0.001, 9e-4), (5e-4, 5e-4)):
        scenario = load_scenario("chapter3", [f"task.max_translation={bound}"])
        scale = task_view(scenario, preset("best")).action_scale
        assert scale[1] == pytest.approx(limit)


def test_demonstrations_fill_their_share_of_each_batch() -> None:
    plain = _training()
    shown = _demonstrations(plain.view)
    shown._rows[:, 18] = 77.0  # a reward that only demonstrations have
    training = _training(memories={"demonstrations": shown}, demonstrations=0.25)
    _run(training)
    batch = training._batch(np.random.default_rng(0))
    assert batch.shape[0] == 16 and (batch[:, 18] == 77.0).sum() == 4


def test_learning_from_a_dataset_alone_resumes_bit_for_bit(tmp_path: Path) -> None:
    plain = _training()
    data = _demonstrations(plain.view)
    dataset = {"dataset": data, "updates": 22}
    whole, first, second = (_training(memories=dataset, episodes=4) for _ in range(3))
    loop = TrainingLoop(None, [whole])
    while loop.unfinished:
        loop.run_round()
    assert whole.agent.updates == 22 and not whole.summaries
    for _ in range(2):
        TrainingLoop(None, [first]).run_round()
    assert first.agent.updates == 11
    first.save(tmp_path / "c.npz")
    second.restore(tmp_path / "c.npz")
    assert second.replay.size == data.size
    for _ in range(2):
        TrainingLoop(None, [second]).run_round()
    _assert_same_bits(whole, second)


def test_a_dataset_teaches_the_critic_the_value_that_it_holds() -> None:
    """One state, one action, reward 1, terminated: Q must become 1."""
    memory = Replay(1)
    memory.add(np.zeros((1, 12)), np.zeros((1, 6)), 1.0, np.zeros((1, 12)), True)
    training = _training(memories={"dataset": memory}, critic_rate=0.01)
    training.learn(400, np.random.default_rng(0))
    assert isinstance(training.agent, ActorCritic)
    q = q_value(training.agent.state.critics[0], torch.zeros(1, 12), torch.zeros(1, 6))
    assert float(q) == pytest.approx(1.0, abs=0.02)


def test_demonstrations_that_are_wanted_but_not_named_are_refused() -> None:
    with refused("demonstrations"):
        _training(demonstrations=0.5)


def test_a_start_from_elsewhere_takes_the_agent_and_nothing_else(tmp_path):
    first = _training("td3")
    _run(first, 2)
    first.save(tmp_path / "c.npz")
    second = _training("td3")
    second.start_from(tmp_path / "c.npz")
    for a, b in zip(*(t.agent.arrays().values() for t in (first, second)), strict=True):
        np.testing.assert_array_equal(a, b)
    assert second.replay.size == 0 and not second.summaries
    assert _run(second)[0] != _run(_training("td3"))[0]


def test_a_folder_is_trained_in_by_one_program_at_a_time(tmp_path, monkeypatch):
    monkeypatch.setattr(run, "_PATIENCE", 0.05)
    another = refused("another program is training there")
    with run._locked(tmp_path), another, run._locked(tmp_path):
        pass
    with run._locked(tmp_path):
        pass


def test_validation_does_not_disturb_the_training() -> None:
    calm, watched = _training(), _training()
    for _ in range(2):
        _run(calm)
        _run(watched)
        validate_policy(_policy(watched), [SCENARIO], "twin", [1, 2])
    _assert_same_bits(calm, watched)
