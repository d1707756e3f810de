"""Which episodes are fitted and which are held out."""

import numpy as np
import pytest

from sysid.identification.split import split_episodes, train_and_test
from tests.refusals import refused

NAMES = [f"one/episode_{i:04d}" for i in range(6)] + ["two/episode_0000"]


def test_a_share_is_taken_evenly():
    train, test = split_episodes(NAMES, 0.3)
    assert len(test) == 2 and sorted(train + test) == list(range(7))
    assert max(np.diff(test)) >= 3


def test_names_of_logs_and_episodes():
    assert split_episodes(NAMES, ["two"])[1] == [6]
    assert split_episodes(NAMES, ["one/episode_0002", "two"])[1] == [2, 6]
    assert split_episodes(NAMES, 0.0) == (list(range(7)), [])
    assert split_episodes(["a/episode_0000"], 0.25) == ([0], [])


def test_refuses_names_that_are_not_there_and_nothing_to_fit():
    with refused("`held_out` tow", "did you mean 'two'"):
        split_episodes(NAMES, ["tow"])
    with refused("`held_out`", "no episode is left"):
        split_episodes(NAMES, ["one", "two"])


@pytest.mark.parametrize(
    ("train", "test", "expected"),
    [
        (None, None, ([0, 1, 2, 4, 5, 6], [3])),
        ([0, 2], None, ([0, 2], [1, 3, 4, 5, 6])),
        (None, [], ([0, 1, 2, 3, 4, 5, 6], [])),
        ([0], [1], ([0], [1])),
    ],
)
def test_one_that_is_left_out_is_all_that_the_other_leaves(train, test, expected):
    assert train_and_test(NAMES, train, test, 0.1) == expected
