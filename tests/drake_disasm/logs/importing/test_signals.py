"""Signal processing of recordings, against closed forms."""

import numpy as np
import pytest

from drake_disasm.logs.importing import signals


@pytest.mark.parametrize("order", [0, 1, 2])
def test_the_filter_and_its_derivatives_have_the_same_gain(order: int) -> None:
    low, t = signals.LowPass(cutoff=20.0, period=0.005), 0.005 * np.arange(2000)
    inner = t[low.reach : -low.reach]
    for w in 2.0 * np.pi * np.array([2.0, 8.0, 14.0]):
        x, wave = np.sin(w * t)[:, None], np.sin(w * inner)
        passed = low(x)[:, 0] @ wave / np.sum(wave**2)
        exact = passed * np.sin(w * inner + 0.5 * np.pi * order)
        np.testing.assert_allclose(low(x, order)[:, 0] / w**order, exact, atol=0.03)


def test_what_is_beyond_the_cutoff_is_gone_and_below_it_there() -> None:
    low, t = signals.LowPass(cutoff=20.0, period=0.005), 0.005 * np.arange(2000)
    slow, fast = (np.sin(2.0 * np.pi * f * t)[:, None] for f in (10.0, 32.0))
    inner = slice(low.reach, -low.reach)
    assert np.abs(low(slow) - slow[inner]).max() < 3e-3
    assert np.abs(low(fast)).max() < 3e-3


def test_a_clock_s_gaps_losses_and_jitter_are_told_apart() -> None:
    steps = np.full(1000, 0.01)
    steps[100], steps[500] = 0.02, 0.5
    clock = signals.clock_of(np.cumsum(steps))
    assert (clock.lost, clock.gaps, clock.repeated) == (1, (pytest.approx(0.5),), 0)
    assert clock.period == pytest.approx(0.01) and not clock.is_even
    parts = signals.stretches(np.cumsum(steps))
    assert [part.stop - part.start for part in parts] == [500, 500]
    assert signals.clock_of(0.01 * np.arange(50)).is_even


@pytest.mark.parametrize("seed", range(5))
def test_poses_and_errors_of_an_encoder_are_no_wraps(seed: int) -> None:
    random, t = np.random.default_rng(seed), 0.01 * np.arange(200)
    poses = random.uniform(-np.pi, np.pi, (200, 1))
    spike = np.sin(t)[:, None]
    spike[50] += 5.0
    for q in (poses, spike):
        found, counts = signals.unwrapped(t, q)
        assert not counts.any()
        np.testing.assert_array_equal(found, q)
