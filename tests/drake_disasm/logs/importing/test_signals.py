"""Signal processing of recordings, against closed forms."""

import numpy as np
import pytest

from drake_disasm.logs.importing import signals


def test_derivatives_of_polynomials() -> None:
    low = signals.LowPass(cutoff=20.0, period=0.005)
    t = 0.005 * np.arange(200)
    x, inner = (1.0 + 2.0 * t + 3.0 * t**2)[:, None], t[low.reach : -low.reach]
    exact = (1.0 + 2.0 * inner + 3.0 * inner**2, 2.0 + 6.0 * inner, 6.0 + 0.0 * inner)
    for order, scale in enumerate((1.0, 10.0, 1e3)):  # of derivatives at 20 Hz
        atol = 2e-3 * scale
        np.testing.assert_allclose(low(x, order)[:, 0], exact[order], atol=atol)


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


def test_uneven_rows_are_brought_to_an_even_time_line() -> None:
    random = np.random.default_rng(2)
    time = 0.01 * (np.arange(500) + 0.1 * random.standard_normal(500))
    at = signals.even_times(time)
    x = signals.resample(time, np.sin(3.0 * time)[:, None], at)
    np.testing.assert_allclose(x[:, 0], np.sin(3.0 * at), atol=1e-5)
    assert np.ptp(np.diff(at)) < 1e-12


def test_rounding_is_recognised() -> None:
    step = 2.0 * np.pi / 4096
    t = np.linspace(0.0, 10.0, 5000)
    assert signals.quantum(np.round(np.sin(t) / step) * step) == pytest.approx(step)
    assert signals.quantum(np.sin(t)) == 0.0
    assert signals.quantum(np.zeros(10)) == 0.0


def _wrap(q: np.ndarray) -> np.ndarray:
    return (q + np.pi) % (2.0 * np.pi) - np.pi


def test_whole_turns_are_taken_out_of_a_joint_that_wraps() -> None:
    t = 0.01 * np.arange(1000)
    q = np.column_stack([np.pi + np.sin(t), 0.5 * t, np.sin(3.0 * t)])
    found, counts = signals.unwrapped(t, _wrap(q))
    left = found - q
    np.testing.assert_allclose(left, np.broadcast_to(left[0], q.shape), atol=1e-9)
    assert counts[0] > 2 and counts[1] == 1 and counts[2] == 0


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
