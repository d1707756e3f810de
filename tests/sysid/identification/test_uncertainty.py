"""Whiteness, block length and bootstrap: cases with a known answer."""

import numpy as np
import pytest
from statsmodels.stats.diagnostic import acorr_ljungbox

from sysid.identification.linearisation import Linearisation
from sysid.identification.uncertainty import block_length, block_numbers, uncertainty
from sysid.identification.whiteness import autocorrelation, ljung_box


def coloured(n, rho, seed=0):
    e = np.random.default_rng(seed).normal(size=n)
    for i in range(1, n):
        e[i] += rho * e[i - 1]
    return e


@pytest.mark.parametrize("rho", [0.0, 0.9])
def test_ljung_box_is_statsmodels(rho):
    residual = coloured(300, rho)
    oracle = acorr_ljungbox(residual - residual.mean(), lags=[10])
    assert ljung_box(residual, 10) == pytest.approx(
        float(oracle["lb_pvalue"].iloc[0]), rel=1e-6, abs=1e-12
    )
    assert autocorrelation(residual, 3)[0] == pytest.approx(rho, abs=0.12)


def test_blocks_are_twice_the_time_over_which_residuals_are_correlated():
    """(1 + rho) / (1 - rho) of a first-order process, in whatever episodes it lies."""
    red = coloured(40_000, 0.8)[:, None]
    for episodes in (1, 40):
        episode = np.repeat(np.arange(episodes), 40_000 // episodes)
        assert block_length(red, episode) == pytest.approx(18, abs=2)


def test_what_lies_in_different_episodes_is_not_correlated():
    both = np.tile([3.0, -3.0], 500) + coloured(1000, 0.0)
    assert block_length(both[:, None], np.repeat(np.arange(500), 2)) == 1


def test_blocks_never_span_two_episodes():
    episode = np.array([0] * 5 + [1] * 3)
    np.testing.assert_array_equal(block_numbers(episode, 2), [0, 0, 1, 1, 2, 3, 3, 4])


@pytest.mark.parametrize("rho", [0.0, 0.8])
def test_the_bootstrap_has_the_spread_of_a_mean(rho):
    """For r = u - y with AR(1) errors the mean's variance is (1+rho)/(1-rho) larger."""
    n = 4000
    r = coloured(n, rho)[:, None]
    linearisation = Linearisation(
        np.array([0.5]), r, np.ones((n, 1, 1)), np.ones((n, 1))
    )
    spread = uncertainty(linearisation, np.zeros(n, dtype=int))
    truth = 1.0 / (1.0 - rho) / np.sqrt(n)
    assert np.std(spread.draws) == pytest.approx(truth, rel=0.3)
    white = np.sqrt(spread.covariance[0, 0])
    assert white == pytest.approx(np.std(r) / np.sqrt(n), rel=0.01)


def test_channels_may_have_noise_of_any_size():
    """An exact channel neither narrows the interval nor lengthens the blocks."""
    n = 2000
    noisy, exact = coloured(n, 0.0), 1e-3 * np.sin(np.arange(n) / 300.0)
    J = np.stack([np.ones(n), 1e-3 * np.ones(n)], axis=1)[:, :, None]
    r = np.column_stack([noisy, exact])
    linearisation = Linearisation(np.array([0.5]), r, J, np.ones((n, 2)))
    spread = uncertainty(linearisation, np.zeros(n, dtype=int))
    assert spread.block <= 4
    for deviation in (np.sqrt(spread.covariance[0, 0]), np.std(spread.draws)):
        assert deviation == pytest.approx(1.0 / np.sqrt(n), rel=0.1)
