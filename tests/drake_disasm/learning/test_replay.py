"""The memory: a ring, sampled with replacement, merged where batches are large."""

import numpy as np
import pytest

from drake_disasm.common.errors import DisasmError
from drake_disasm.learning.replay import WIDTH, Replay


def _filled(count: int, capacity: int = 5000) -> Replay:
    replay = Replay(capacity)
    for i in range(count):
        replay.add(np.full(12, i), np.zeros(6), float(i), np.full(12, i + 1), i % 2 > 0)
    return replay


def test_a_row_is_what_was_added() -> None:
    row = _filled(4).contents()[0][3]
    np.testing.assert_array_equal(row[:12], 3.0)
    np.testing.assert_array_equal(row[12:18], 0.0)
    assert row[18] == 3.0 and row[31] == 1.0 and row[32] == 1.0
    np.testing.assert_array_equal(row[19:31], 4.0)


def test_the_oldest_gives_way() -> None:
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
        replay.add(np.zeros(12), np.zeros(6), -1.0, np.zeros(12), False)
    np.testing.assert_array_equal(old.contents()[0], new.contents()[0])


@pytest.mark.parametrize("shape", [(9, WIDTH), (3, WIDTH - 1)])
def test_what_does_not_fit_is_refused(shape: tuple[int, int]) -> None:
    with pytest.raises(DisasmError, match="does not fit"):
        Replay(5).restore(np.zeros(shape, np.float32), 0)
