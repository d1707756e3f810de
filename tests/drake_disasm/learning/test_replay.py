"""The memory: a ring, sampled with replacement; and what a log teaches it."""

import dataclasses
from pathlib import Path

import numpy as np

from drake_disasm.learning.dataset import remember
from drake_disasm.learning.environments import make_environments
from drake_disasm.learning.hyperparameters import preset
from drake_disasm.learning.loop import TrainingLoop
from drake_disasm.learning.replay import WIDTH, Replay
from drake_disasm.learning.training import TrainingSpec, make_training, task_view
from drake_disasm.logs import LogHeader, LogWriter, flat_columns, read_log
from drake_disasm.logs.transitions import observations
from drake_disasm.scenario import load_scenario
from tests.refusals import refused

SCENARIO = load_scenario("chapter3", ["imprecision=0.0002", "task.steps=12"])


def _filled(count: int, capacity: int = 5000) -> Replay:
    replay = Replay(capacity)
    for i in range(count):
        state = np.full((1, 12), i)
        replay.add(state, np.zeros((1, 6)), float(i), state + 1, i % 2 > 0)
    return replay


def test_a_row_is_what_was_added_and_the_oldest_gives_way() -> None:
    row = _filled(4).contents()[0][3]
    np.testing.assert_array_equal(row[:12], 3.0)
    np.testing.assert_array_equal(row[12:18], 0.0)
    assert row[18] == 3.0 and row[31] == 1.0 and row[32] == 1.0
    np.testing.assert_array_equal(row[19:31], 4.0)
    replay = _filled(7, capacity=5)
    assert replay.size == 5
    assert sorted(replay.contents()[0][:, 18]) == [2, 3, 4, 5, 6]


def test_only_large_batches_are_merged_and_no_draw_is_lost() -> None:
    rows = _filled(10).sample(30, np.random.default_rng(0))
    assert rows.shape == (30, WIDTH) and (rows[:, -1] == 1.0).all()
    replay = _filled(500)
    rows = replay.sample(2000, np.random.default_rng(0))
    draws = np.random.default_rng(0).integers(500, size=2000)
    assert len(rows) == len(set(draws)) and rows[:, -1].sum() == 2000
    times = dict(zip(rows[:, 18].astype(int), rows[:, -1], strict=True))
    assert times == {i: np.sum(draws == i) for i in set(draws)}
    assert (replay.contents()[0][:, -1] == 1.0).all()


def test_contents_restore_the_ring() -> None:
    old, new = _filled(7, capacity=5), Replay(5)
    new.restore(*old.contents())
    for replay in (old, new):
        replay.add(np.zeros((1, 12)), np.zeros((1, 6)), -1.0, np.zeros((1, 12)), False)
    np.testing.assert_array_equal(old.contents()[0], new.contents()[0])
    for shape in ((9, WIDTH), (3, WIDTH - 1)):
        with refused("does not fit"):
            Replay(5).restore(np.zeros(shape, np.float32), 0)


def test_a_log_teaches_what_was_lived_through(tmp_path: Path) -> None:
    changes = {"hidden": [4], "base": "admittance", "exploration": 0.0002}
    config = dataclasses.replace(preset("chapter3"), **changes)
    spec = TrainingSpec(SCENARIO, "twin", config, 3, compiled=False)
    training = make_training(spec)
    loop = TrainingLoop(make_environments([spec]), [training])
    header = LogHeader("transitions", "chapter3", {}, period=0.1)
    writer = LogWriter(tmp_path / "log", header)
    for _ in range(2):
        [(_, columns)] = loop.run_round()[0]
        assert columns
        writer.write_episode(flat_columns("transitions", columns))
    memory = Replay(100)
    for episode in read_log(tmp_path / "log").episodes:
        actions, end = episode["action"][:-1], bool(episode["terminated"][-1])
        chosen = task_view(SCENARIO, config)
        seen = observations(episode)
        remember(memory, seen, actions, end, SCENARIO, chosen)
    lived, read = training.replay.contents()[0], memory.contents()[0]
    np.testing.assert_allclose(read, lived, atol=2e-5)


def test_an_action_out_of_reach_is_cut_to_the_nearest() -> None:
    config, memory = preset("chapter3"), Replay(5)
    actions = np.array([[0.009, -0.009, 0.0015, 0, 0, 0]])
    chosen = task_view(SCENARIO, config)
    remember(memory, np.zeros((2, 12)), actions, False, SCENARIO, chosen)
    np.testing.assert_allclose(memory.contents()[0][0, 12:15], [1.0, -1.0, 0.5])
