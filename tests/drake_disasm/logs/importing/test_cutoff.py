"""The cut-off that a motion asks for, against motions whose acceleration is known."""

import numpy as np
import pytest

from drake_disasm.logs.importing.cutoff import chosen_cutoff, motion_spectra
from drake_disasm.logs.importing.signals import LowPass

_PERIOD = 0.002


def _motion(seconds: float = 40.0) -> tuple[np.ndarray, np.ndarray]:
    """Returns a position (n,) of four harmonics up to 2 Hz, and its acceleration."""
    t, w = np.arange(0.0, seconds, _PERIOD), 2.0 * np.pi * np.array([0.2, 0.6, 1.2, 2])
    waves = np.sin(np.outer(t, w)) / w**1.5
    return waves.sum(axis=1), -(waves * w**2).sum(axis=1)


def _cutoff(*joints: np.ndarray, every: int = 1) -> float:
    """Returns the cut-off for joints of which every so many rows were recorded."""
    period = every * _PERIOD
    return chosen_cutoff(motion_spectra([np.stack(joints, 1)[::every]], period), period)


def _noise(n: int, size: float, seed: int = 3) -> np.ndarray:
    return size * np.random.default_rng(seed).standard_normal(n)


@pytest.mark.parametrize("kind", ["white", "rounded", "jitter"])
def test_little_is_lost_and_little_is_noise(kind: str) -> None:
    q, vd = _motion()
    if kind == "white":
        measured = q + _noise(len(q), 1e-5)
    elif kind == "rounded":
        measured = np.round(q / 1e-4) * 1e-4
    else:
        measured = q + np.gradient(q, _PERIOD) * _noise(len(q), 0.05 * _PERIOD)
    low = LowPass(_cutoff(measured), _PERIOD)
    exact, inner = low(vd[:, None]), vd[low.reach : -low.reach]
    error = low(measured[:, None], 2) - exact
    # A hundredth of the variance is a tenth of the rms.
    assert error.std() < 0.15 * vd.std()
    assert abs(exact[:, 0] - inner).max() < 0.1 * vd.std()


def test_a_joint_that_rests_has_no_say() -> None:
    q = _motion()[0]
    measured, still = q + _noise(len(q), 1e-5), 1e-5 * (_noise(len(q), 1.0, 4) > 1.0)
    alone = _cutoff(measured)
    assert _cutoff(measured, np.zeros(len(q))) == alone
    assert _cutoff(measured, still) == alone


def test_a_slow_noisy_joint_does_not_cut_a_fast_one_s_motion() -> None:
    q, t = _motion()[0], np.arange(0.0, 40.0, _PERIOD)
    slow = 0.05 * np.sin(0.6 * t)
    found = _cutoff(q + _noise(len(q), 1e-6), slow + _noise(len(q), 1e-4, 4))
    assert found > 2.0


def test_without_noise_friction_decides() -> None:
    t = np.arange(0.0, 20.0, _PERIOD)
    found = _cutoff(np.sin(2.0 * np.pi * t))
    # Of a square wave of 1 Hz all but a hundredth is below 40 Hz.
    assert 40.0 <= found < 60.0


def test_the_share_of_noise_is_told() -> None:
    q = _motion()[0]
    measured = q + _noise(len(q), 1e-5)
    [spectrum] = motion_spectra([measured[:, None]], _PERIOD)
    for cutoff in (20.0, 40.0):
        low = LowPass(cutoff, _PERIOD)
        noise = low((measured - q)[:, None], 2).std() / low(measured[:, None], 2).std()
        assert spectrum.noise_share(cutoff) == pytest.approx(noise, rel=0.15)
