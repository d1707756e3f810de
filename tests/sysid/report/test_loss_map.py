"""Where held-out rows cost most."""

import numpy as np
import pytest

from sysid.models import Channel
from sysid.report.loss_map import loss_map
from sysid.residuals.held_out import HeldOut


def _errors(after, episode=None, names=("log",), period=None):
    rows = len(after)
    return HeldOut(
        np.zeros((rows, 2)),
        np.ones((rows, 2)),
        np.asarray(after, dtype=float),
        np.zeros(rows, dtype=np.int64) if episode is None else episode,
        (Channel("fx", "N", 0.5), Channel("fy", "N", 1.0)),
        "",
        50,
        names,
        period,
    )


def test_the_episode_that_drives_the_loss_comes_first():
    after = np.full((30, 2), 0.1)
    after[10:20, 1], after[14, 1] = 1.0, -1.5
    episode = np.repeat([0, 1, 2], 10)
    found = loss_map(_errors(after, episode, ("a", "b", "c")), np.inf)
    assert found.labels == ("a", "b", "c")
    assert found.before.shape == (2, 3) and found.before[0] == pytest.approx(2.0)
    worst = found.stretches[0]
    assert (worst.row, worst.channel, worst.where) == (14, 1, "b, row 4")
    assert worst.size == -1.5 and worst.share > 0.8


def test_one_episode_is_cut_into_stretches():
    after = np.full((400, 2), 0.1)
    after[200:210, 0] = 2.0
    found = loss_map(_errors(after, period=0.5), np.inf)
    assert len(found.labels) == 40 and found.labels[20] == "100 s"
    assert found.stretches[0].where == "log, 100.000 s"
    assert int(np.argmax(found.after[0])) == 20


def test_a_single_reading_that_stands_out_is_told_from_a_bad_stretch():
    after = np.full((400, 2), 0.1)
    assert not loss_map(_errors(after), np.inf).outstanding
    after[33, 1] = 5.0
    (found,) = loss_map(_errors(after), np.inf).outstanding
    assert (found.row, found.channel, found.where) == (33, 1, "log, row 33")
    # What counts linearly weighs less.
    (robust,) = loss_map(_errors(after), 1.0).outstanding
    assert robust.share < found.share
