"""Verdict, split, whiteness, bootstrap: each on a case with a known answer."""

import numpy as np
import pytest
from statsmodels.stats.diagnostic import acorr_ljungbox

from drake_disasm.common.errors import DisasmError
from sysid.identification.agreement import compare_methods
from sysid.identification.linearisation import Linearisation
from sysid.identification.split import split_episodes
from sysid.identification.uncertainty import (
    Uncertainty,
    block_length,
    block_numbers,
    uncertainty,
)
from sysid.identification.whiteness import autocorrelation, ljung_box

SPREAD = Uncertainty(
    1e-4 * np.eye(2),
    1e-4 * np.eye(2),
    1e-2 * np.random.default_rng(0).normal(size=(2000, 2)),
    1,
)


def judge(points, values):
    return compare_methods(("bees", "nlopt"), points, values, 1000, SPREAD, ("a", "b"))


def test_agreement():
    found = judge((np.array([0.5, 0.5]), np.array([0.501, 0.499])), (1.0, 1.0005))
    assert found.agree and "agree" in found.text
    assert found.distance < 1 and found.objective_gap < 1


def test_one_that_is_stuck_is_named():
    found = judge((np.array([0.5, 0.5]), np.array([0.9, 0.1])), (1.0, 1.4))
    assert not found.agree
    assert found.text.startswith("nlopt is stuck") and "Take bees's" in found.text


def test_same_value_elsewhere_is_not_identifiable():
    found = judge((np.array([0.5, 0.5]), np.array([0.7, 0.495])), (1.0, 1.0))
    assert not found.agree and found.objective_gap < 1 < found.distance
    assert "less precisely" in found.text and "a by 20)" in found.text


def test_the_edge_is_that_of_the_likelihood_region():
    """n (f1^2 - f2^2) / f2^2 = 5.99 for two parameters at 95 %."""
    at_edge = np.sqrt(1.0 + 5.991 / 1000)
    same = np.array([0.5, 0.5])
    assert judge((same, same), (1.0, at_edge)).objective_gap == pytest.approx(
        1, abs=0.1
    )


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
    with pytest.raises(DisasmError, match="did you mean 'two'"):
        split_episodes(NAMES, ["tow"])
    with pytest.raises(DisasmError, match="no episode is left"):
        split_episodes(NAMES, ["one", "two"])


def coloured(n, rho, seed=0):
    e = np.random.default_rng(seed).normal(size=n)
    for i in range(1, n):
        e[i] += rho * e[i - 1]
    return e


@pytest.mark.parametrize("rho", [0.0, 0.2, 0.9])
def test_ljung_box_is_statsmodels(rho):
    residual = coloured(300, rho)
    oracle = acorr_ljungbox(residual - residual.mean(), lags=[10])
    assert ljung_box(residual, 10) == pytest.approx(
        float(oracle["lb_pvalue"].iloc[0]), rel=1e-6, abs=1e-12
    )
    assert autocorrelation(residual, 3)[0] == pytest.approx(rho, abs=0.12)


def test_blocks_are_longer_where_residuals_are_correlated():
    episode = np.repeat([0, 1], 500)
    white = coloured(1000, 0.0)[:, None]
    red = coloured(1000, 0.9)[:, None]
    assert block_length(white, episode) <= 4
    assert block_length(red, episode) >= 20


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
