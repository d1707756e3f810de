"""The loop: rounds on a batch, seeds side by side, tensors, and going on."""

import dataclasses
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.envs.classic_control import PendulumEnv
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.wrappers import TimeLimit

from drake_disasm.common.errors import DisasmError
from drake_disasm.learning.actor_critic import ActorCritic
from drake_disasm.learning.environments import (
    GymnasiumRows,
    TwinRows,
    make_environments,
)
from drake_disasm.learning.experiment import Experiment
from drake_disasm.learning.hyperparameters import preset
from drake_disasm.learning.loop import Ended, TrainingLoop
from drake_disasm.learning.training import Training, TrainingSpec, make_training
from drake_disasm.mdp import Outcome
from drake_disasm.policies import TaskView
from drake_disasm.scenario import load_scenario
from drake_disasm.twin.batch import BatchedTwin
from tests.drake_disasm.conftest import without_imprecision
from tests.refusals import refused

_OVERRIDES = ["contact.model=impact", "ft_sensor.noise=[0, 0, 0, 0, 0, 0]"]
_OVERRIDES += ["task.steps=4", "task.max_translation=0.002"]
SCENARIO = without_imprecision(load_scenario("removal_randomised", _OVERRIDES))


def _spec(envs: int = 1, device: str = "numpy", **changes: Any) -> TrainingSpec:
    small = {"hidden": [8], "batch": 16, "exploration": 0.001, "episodes": 5} | changes
    config = dataclasses.replace(preset("chapter3", "ddpg"), **small)
    return TrainingSpec(
        SCENARIO, "twin", config, 5, compiled=False, envs=envs, device=device
    )


def _loop(*specs: TrainingSpec) -> TrainingLoop:
    """Returns a loop of trainings; several have a twin of a batch each."""
    trainings = [make_training(spec) for spec in specs]
    return TrainingLoop(make_environments(specs), trainings)


def _ended(loop: TrainingLoop) -> dict[int, Ended]:
    """Returns all episodes of a loop, by training."""
    ended = dict[int, Ended]()
    while loop.unfinished:
        for number, episodes in loop.run_round().items():
            ended.setdefault(number, []).extend(episodes)
    return ended


def _bits(training: Training) -> list[np.ndarray]:
    return [*training.agent.arrays().values(), training.replay.contents()[0]]


def _assert_same_rows(ended: Ended, expected: Ended) -> None:
    for (one, found), (other, known) in zip(ended, expected, strict=True):
        for name in ("seed", "steps", "outcome"):
            assert getattr(one, name) == getattr(other, name)
        assert one.reward == pytest.approx(other.reward, abs=0.06)
        assert one.max_force == pytest.approx(other.max_force, abs=0.02)
        assert found and known and found.keys() == known.keys()
        for name, values in known.items():
            assert found[name].shape == values.shape, name
            assert found[name].dtype == values.dtype, name
            close = {"wrench": 0.02, "ft_sensor": 0.02}.get(name, 1e-5)
            close = 0.06 if name.startswith("reward.") else close  # 0.02 N in the grip
            np.testing.assert_allclose(found[name], values, atol=close, err_msg=name)


def test_a_round_is_the_diagrams_episodes_one_after_the_other():
    """As long as nothing is learned: seeds, ranges, exploration, rewards and logs."""
    together, apart = (_loop(_spec(n, warmup_episodes=9)) for n in (3, 1))
    _assert_same_rows(together.run_round()[0], _ended(apart)[0][:3])
    found, there = (  # in a batch they come in another order
        rows[np.argsort(rows[:, 12]), :18]
        for rows in (
            t.trainings[0].replay.contents()[0][:12] for t in (together, apart)
        )
    )
    np.testing.assert_allclose(found, there, atol=0.01)


@pytest.mark.parametrize(("schedule", "device"), [
    ("delayed", "numpy"), ("every_step", "numpy"), ("delayed", "cpu"),
])  # fmt: skip
def test_a_restored_training_goes_on_bit_for_bit(schedule, device, tmp_path):
    spec = _spec(2, device, schedule=schedule)
    whole, first, second = (_loop(spec) for _ in range(3))
    _ended(whole)
    first.run_round()
    first.trainings[0].save(tmp_path / "c.npz")
    second.trainings[0].restore(tmp_path / "c.npz")
    _ended(second)
    one, other = whole.trainings[0], second.trainings[0]
    assert [s.steps for s in one.summaries] == [4] * 5  # the last round has one
    assert other.summaries == one.summaries
    assert other.agent.updates == one.agent.updates == 20
    for a, b in zip(_bits(one), _bits(other), strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("algorithm", ["ddpg", "td3", "sac"])
def test_tensors_learn_the_task_that_numpys_rows_do(algorithm: str) -> None:
    """From the step to the update; random numbers are others, episodes are the same."""
    changes = {"algorithm": algorithm, "base": "admittance", "residual": [0.1] * 6}
    changes |= {"exploration": 0.0, "log_sigma": -20.0, "warmup_episodes": 3}
    loops = [_loop(_spec(3, device, **changes)) for device in ("numpy", "cpu")]
    _assert_same_rows(*(loop.run_round()[0] for loop in loops))
    for loop in loops:
        _ended(loop)
    one, other = (loop.trainings[0] for loop in loops)
    assert one.agent.updates == other.agent.updates == 8
    for a, b in zip(_bits(one)[-1][:12], _bits(other)[-1][:12], strict=True):
        np.testing.assert_allclose(a, b, atol=1e-4)
    assert all(np.isfinite(array).all() for array in _bits(other))


def test_fewer_updates_than_steps_are_owed_until_one_is_whole() -> None:
    loop = _loop(_spec(3, schedule="every_step", updates_per_step=0.25, episodes=3))
    loop.run_round()
    assert loop.trainings[0].agent.updates == 3  # of twelve steps, three at a time


def test_an_episode_whose_simulation_fails_is_not_learned_from():
    spec = _spec(2, warmup_episodes=9)
    twin = BatchedTwin(spec.scenario, 2, "numpy")
    begin = twin.reset

    def broken(seeds: list[int]) -> Any:
        observation = begin(seeds)
        twin.episodes.state.q[1, 0] = np.nan
        return observation

    twin.reset = broken  # type: ignore[method-assign]
    training = make_training(spec)
    TrainingLoop(TwinRows(twin), [training]).run_round()
    assert [s.steps for s in training.summaries] == [4, 1]
    assert training.summaries[1].outcome is Outcome.RUNNING
    assert training.replay.size == 4
    assert np.isfinite(training.replay.contents()[0]).all()


@pytest.mark.parametrize(("changes", "words"), [
    ({"envs": 4, "station": "cell"}, "envs: station 'cell' has no batch"),
    ({"envs": 4, "logs": {"a": "b"}}, "envs: 4 episodes"),
    ({"envs": 4, "lockstep": True}, "lockstep: "),
    ({"station": "cell", "lockstep": True}, "lockstep: "),
    ({"logs": {"a": "b"}, "lockstep": True}, "lockstep: "),
    ({"device": "cpu"}, "device: 'cpu' computes for many"),
    ({"device": "cuda:9", "envs": 4}, "device: 'cuda:9' is not there"),
])  # fmt: skip
def test_what_has_no_batch_is_refused(changes: dict[str, Any], words: str) -> None:
    plain = Experiment(SCENARIO, "twin", "best", preset("best"))
    dataclasses.replace(plain, envs=4, device="cpu")
    dataclasses.replace(plain, lockstep=True)
    with pytest.raises(DisasmError, match=words):
        dataclasses.replace(plain, **changes)


def _pendulums(mode: AutoresetMode = AutoresetMode.NEXT_STEP) -> SyncVectorEnv:
    make = lambda: TimeLimit(PendulumEnv(), 5)  # noqa: E731
    return SyncVectorEnv([make] * 2, autoreset_mode=mode)


def _on_pendulums() -> TrainingLoop:
    rows = GymnasiumRows(_pendulums())
    config = _spec(schedule="every_step").config
    agent = ActorCritic(config, 0, False, *rows.sizes)
    training = Training(agent, config, seed=0, sizes=rows.sizes)
    return TrainingLoop(rows, [training])


def test_a_vector_environment_of_gymnasium_is_trained_in(tmp_path: Path) -> None:
    """With three numbers that are seen and one that is chosen; it resumes."""
    whole, first, second = (_on_pendulums() for _ in range(3))
    ended = _ended(whole)[0]
    assert [(s.steps, s.outcome) for s, _ in ended] == [(5, Outcome.STEP_LIMIT)] * 5
    assert all(s.reward < 0.0 and columns is None for s, columns in ended)
    first.run_round()
    first.trainings[0].save(tmp_path / "c.npz")
    second.trainings[0].restore(tmp_path / "c.npz")
    _ended(second)
    one, other = whole.trainings[0], second.trainings[0]
    for a, b in zip(_bits(one), _bits(other), strict=True):
        np.testing.assert_array_equal(a, b)
    rows = one.replay.contents()[0]
    assert rows.shape == (25, 10) and not rows[:, -2].any()
    np.testing.assert_array_equal(rows[2, :3], rows[0, 5:8])  # the step after
    torque = _pendulums()
    torque.reset(seed=[summary.seed for summary, _ in ended[:2]])
    observation, *_ = torque.step(2.0 * rows[:2, 3:4])  # within [-2, 2] N m
    np.testing.assert_allclose(observation, rows[:2, 5:8], atol=1e-6)


def test_a_view_of_other_sizes_is_refused() -> None:
    config = _spec().config
    agent = ActorCritic(config, 0, False, 3, 1)
    for view, words in (
        (TaskView(np.ones(12), np.ones(1)), "12 and 1"),
        (TaskView(np.ones(3), np.ones(6)), "3 and 6"),
    ):
        with refused("view", words, "not of 3 and 1"):
            Training(agent, config, seed=0, view=view, sizes=(3, 1))


def test_a_vector_environment_that_does_not_fit_is_refused() -> None:
    with refused("AutoresetMode.NEXT_STEP"):
        GymnasiumRows(_pendulums(AutoresetMode.SAME_STEP))
    rows = GymnasiumRows(_pendulums())
    rows.begin(np.arange(1), [3])
    with refused("begin together", "of its own"):  # another training's
        rows.begin(np.arange(1, 2), [4])
    with refused("action_space: Discrete(2)", "flatten"):
        GymnasiumRows(gymnasium.make_vec("CartPole-v1", 2, "sync"))
    with refused("PendulumEnv", "make_vec"):
        GymnasiumRows(PendulumEnv())
    boundless = _pendulums()
    boundless.single_action_space = gymnasium.spaces.Box(-np.inf, np.inf, (1,))
    with refused("action_space", "bounds"):
        GymnasiumRows(boundless)


def test_an_observation_that_is_not_finite_is_no_lesson() -> None:
    rows = GymnasiumRows(_pendulums())
    rows.begin(np.arange(2), [0, 1])
    rows._envs.env.envs[0].unwrapped.state[:] = np.nan
    with refused("not finite"):
        rows.step(np.zeros((2, 1)))


def _side_by_side(**changes: Any) -> list[TrainingSpec]:
    """Returns trainings of three seeds, of which one has another task."""
    specs = [dataclasses.replace(_spec(**changes), seed=seed) for seed in range(3)]
    longer = dataclasses.replace(SCENARIO.task, steps=6)
    other = dataclasses.replace(SCENARIO, task=longer)
    return [*specs[:2], dataclasses.replace(specs[2], scenario=other)]


def test_trainings_side_by_side_are_the_diagrams_one_by_one():
    specs = _side_by_side(warmup_episodes=9, episodes=2)
    together = _loop(*specs)
    ended = _ended(together)  # the second begins while others run
    assert [t.summaries[0].steps for t in together.trainings] == [4, 4, 6]
    for number, training in enumerate(together.trainings):
        _assert_same_rows(ended[number], _ended(_loop(specs[number]))[0])
        assert training.replay.size == sum(s.steps for s in training.summaries)


def test_each_of_them_learns_from_its_own_episodes_until_it_has_enough():
    specs = _side_by_side()
    more = dataclasses.replace(specs[0].config, episodes=7)
    together = _loop(dataclasses.replace(specs[0], config=more), *specs[1:])
    ended = list[list[int]]()
    while together.unfinished:
        ended.append(sorted(together.run_round()))
    assert ended[:4] == [[0, 1], [2], [0, 1], [0, 1, 2]]  # nobody waits: 4 and 6 steps
    assert [len(t.summaries) for t in together.trainings] == [7, 5, 5]
    assert [t.agent.updates for t in together.trainings] == [28, 20, 30]
