"""Rows in free space are found, or it is said that they are not told."""

import numpy as np
import pytest

from sysid.models.free_space import free_space
from tests.sysid.models.contact_task import NOISE, task


def found(of, rows=slice(None)):
    wrench, time = of.wrench[rows], of.time[rows]
    episode = np.zeros(len(time), dtype=int)
    return free_space(time, episode, of.R_WS[rows].as_matrix(), wrench)


def touched(of):
    """Rows whose contact shows above the noise."""
    return (np.abs(of.contact) > 2.0 * NOISE).any(axis=1)


ten = task()
clock = (ten.time / ten.time[-1])[:, None]


@pytest.mark.parametrize(
    "more",
    [
        0.0 * ten.load,
        clock * [3.0, 0.0, -2.0, 0.1, 0.0, 0.0],
        np.exp(-4.0 * clock) * [2.0, 0.0, 0.0, 0.0, 0.05, 0.0],
        (clock > 0.45) * [2.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        0.1 * ten.load[:, [2]] * [0.0, 1.0, 0.0, 0.0, 0.0, 0.0],
    ],
    ids=["nothing", "drift", "warm-up", "step", "cross-talk"],
)
def test_what_a_sensor_does_is_not_taken_for_contact(more):
    of = ten.plus(more)
    space = found(of)
    assert space.is_told and not (space.rows & touched(of)).any()
    assert (space.rows & of.free).sum() > 0.65 * of.free.sum()
    assert (space.steady & of.free).sum() < 0.2 * of.free.sum()


def test_a_tilted_base_is_not_taken_for_contact():
    of = task(1)
    down = np.array([0.0, 9.81 * np.sin(0.05), 9.81 * (1.0 - np.cos(0.05))])
    tilt = np.zeros_like(of.load)
    tilt[:, :3] = 1.2 * of.R_WS.inv().apply(down)
    space = found(of.plus(tilt))
    assert space.is_told and not (space.rows & touched(of)).any()


def test_a_wrench_without_a_load_has_free_rows_too():
    of = task(share=0.5)
    space = found(of.plus(-of.load))
    assert space.is_told and not (space.rows & touched(of)).any()
    assert (space.rows & of.free).sum() > 0.8 * of.free.sum()


def test_without_contact_all_rows_are_free():
    space = found(ten.plus(-ten.contact))
    assert space.rows.mean() > 0.95 and not space.rival
    np.testing.assert_allclose(space.noise, NOISE, rtol=0.7)


def test_a_zero_that_moves_is_steady_where_little_agrees_with_it():
    """After the step a tenth of the log is free: too little to believe in a step."""
    of = ten.plus((clock > 0.75) * [2.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    space = found(of)
    after = of.free & (of.time > 0.76 * of.time[-1])
    assert not space.rows[after].any() and space.steady[after].mean() > 0.5


@pytest.mark.parametrize("seed", range(2))
def test_where_contacts_are_held_for_as_long_nothing_is_told(seed):
    assert not found(task(seed, share=0.15)).is_told


def test_few_rows_tell_nothing():
    space = found(ten, slice(0, 40))
    assert not space.is_told and not space.rows.any()
