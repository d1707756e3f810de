"""Learning from many episodes at a time: the diagram's episodes, and going on."""

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from torch.utils._pytree import tree_leaves

from drake_disasm.common.errors import DisasmError
from drake_disasm.learning.hyperparameters import preset
from drake_disasm.learning.lockstep import (
    LockstepTraining,
    LockstepTrainings,
    refuse_envs,
)
from drake_disasm.learning.training import Training, TrainingSpec
from drake_disasm.mdp import Outcome
from drake_disasm.scenario import load_scenario
from drake_disasm.task.recording import EpisodeRecorder
from drake_disasm.twin.history import RecordedEpisode
from tests.drake_disasm.conftest import without_imprecision

_OVERRIDES = ["contact.model=impact", "ft_sensor.noise=[0, 0, 0, 0, 0, 0]"]
_OVERRIDES += ["task.steps=4", "task.max_translation=0.002"]
SCENARIO = without_imprecision(load_scenario("removal_randomised", _OVERRIDES))


def _training(envs: int, **changes: Any) -> Training:
    small = {"hidden": [8], "batch": 16, "exploration": 0.001, "episodes": 5} | changes
    config = dataclasses.replace(preset("chapter3", "ddpg"), **small)
    spec = TrainingSpec(SCENARIO, "twin", config, 5, compiled=False, envs=envs)
    return LockstepTraining(spec) if envs > 1 else Training(spec)


def test_a_round_is_the_diagrams_episodes_one_after_the_other():
    """As long as nothing is learned: seeds, ranges, exploration, rewards and logs."""
    together, apart = _training(3, warmup_episodes=9), _training(1, warmup_episodes=9)
    recorded = [records for _, records in together.run_episodes()]
    expected = [apart.run_episode()[1] for _ in range(3)]
    for one, other in zip(together.summaries, apart.summaries, strict=True):
        for name in ("seed", "steps", "outcome"):
            assert getattr(one, name) == getattr(other, name)
        assert one.reward == pytest.approx(other.reward, abs=0.06)
        assert one.max_force == pytest.approx(other.max_force, abs=0.02)
    for one, other in zip(recorded, expected, strict=True):
        _assert_same_rows(one.columns(), other)
    found, there = (  # in lockstep they come in another order
        rows[np.argsort(rows[:, 12]), :18]
        for rows in (together.replay.contents()[0], apart.replay.contents()[0])
    )
    np.testing.assert_allclose(found, there, atol=0.01)


def _assert_same_rows(found: dict[str, np.ndarray], recorder: EpisodeRecorder) -> None:
    expected = recorder.columns()
    assert found.keys() == expected.keys()
    for name, values in expected.items():
        assert found[name].shape == values.shape, name
        assert found[name].dtype == values.dtype, name
        close = {"wrench": 0.02, "ft_sensor": 0.02}.get(name, 1e-5)
        close = 0.06 if name.startswith("reward.") else close  # 0.02 N in the grip
        np.testing.assert_allclose(found[name], values, atol=close, err_msg=name)


@pytest.mark.parametrize("schedule", ["delayed", "every_step"])
def test_a_restored_training_goes_on_bit_for_bit(schedule: str, tmp_path: Path) -> None:
    whole, first, second = (_training(2, schedule=schedule) for _ in range(3))
    for _ in range(3):
        whole.run_episodes()
    assert [s.steps for s in whole.summaries] == [4] * 5  # the last round has one
    first.run_episodes()
    first.save(tmp_path / "c.npz")
    second.restore(tmp_path / "c.npz")
    for _ in range(2):
        second.run_episodes()
    assert second.summaries == whole.summaries
    assert second.agent.updates == whole.agent.updates == 20
    for one, other in zip(_bits(whole), _bits(second), strict=True):
        np.testing.assert_array_equal(one, other)


def _bits(training: Training) -> list[np.ndarray]:
    leaves = [leaf.numpy() for leaf in tree_leaves(training.agent.state)]
    return [*leaves, training.replay.contents()[0]]


def test_an_episode_whose_simulation_fails_is_not_learned_from():
    training = _training(2, warmup_episodes=9)
    assert isinstance(training, LockstepTraining)
    twin, begin = training._twin, training._twin.reset

    def broken(seeds: list[int]) -> Any:
        observation = begin(seeds)
        twin.episodes.state.q[1, 0] = np.nan
        return observation

    twin.reset = broken  # type: ignore[method-assign]
    training.run_episodes()
    assert [s.steps for s in training.summaries] == [4, 1]
    assert training.summaries[1].outcome is Outcome.RUNNING
    assert training.replay.size == 4
    assert np.isfinite(training.replay.contents()[0]).all()


@pytest.mark.parametrize(("envs", "station", "acts", "lockstep", "words"), [
    (4, "cell", True, False, "envs: station 'cell' has no batch"),
    (4, "twin", False, False, "envs: 4 episodes"),
    (4, "twin", True, True, "lockstep: "),
    (1, "cell", True, True, "lockstep: "),
    (1, "twin", False, True, "lockstep: "),
])  # fmt: skip
def test_what_has_no_batch_is_refused(envs, station, acts, lockstep, words):
    refuse_envs(1, station, acts)
    refuse_envs(1, "twin", acts=True, lockstep=True)
    with pytest.raises(DisasmError, match=words):
        refuse_envs(envs, station, acts, lockstep=lockstep)


def _side_by_side(count: int, **changes: Any) -> LockstepTrainings:
    """Returns trainings of several seeds, of which one has another task."""
    trainings = [_training(1, **changes) for _ in range(count)]
    for seed, training in enumerate(trainings):
        training.spec = dataclasses.replace(training.spec, seed=seed)
    longer = dataclasses.replace(SCENARIO.task, steps=6)
    other = dataclasses.replace(SCENARIO, task=longer)
    last = trainings[-1]
    last.spec = dataclasses.replace(last.spec, scenario=other)
    return LockstepTrainings(trainings)


def test_trainings_side_by_side_are_the_diagrams_one_by_one():
    together = _side_by_side(3, warmup_episodes=9)
    recorded = dict[int, list[RecordedEpisode]]()
    while together.unfinished:
        for number, episode in together.run_episodes().items():
            recorded.setdefault(number, []).append(episode)
    assert [t.summaries[0].steps for t in together.trainings] == [4, 4, 6]
    for number, training in enumerate(together.trainings):
        alone = _training(1, warmup_episodes=9)
        alone.spec = training.spec
        for found in recorded[number][:2]:  # the second begins while others run
            _assert_same_rows(found.columns(), alone.run_episode()[1])
        assert training.replay.size == sum(s.steps for s in training.summaries)


def test_each_of_them_learns_from_its_own_episodes_until_it_has_enough():
    together = _side_by_side(3)
    more = together.trainings[0]
    more.spec = dataclasses.replace(
        more.spec, config=dataclasses.replace(more.spec.config, episodes=7)
    )
    ended = list[list[int]]()
    while together.unfinished:
        ended.append(sorted(together.run_episodes()))
    assert ended[:4] == [[0, 1], [2], [0, 1], [0, 1, 2]]  # nobody waits: 4 and 6 steps
    assert [len(t.summaries) for t in together.trainings] == [7, 5, 5]
    assert [t.agent.updates for t in together.trainings] == [28, 20, 30]
