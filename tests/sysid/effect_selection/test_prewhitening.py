"""Filters that whiten residuals: against processes whose model is known."""

import numpy as np
import pytest
from scipy.signal import lfilter

from sysid.effect_selection.prewhitening import ArFilter, Prewhitening
from sysid.effect_selection.settings import SelectionSettings
from sysid.identification.whiteness import autocorrelation

_ONE_EPISODE = np.zeros(2000, dtype=np.int64)


def _process(*coefficients, rows=2000, seed=0):
    """Returns x_t = sum_i c_i x_(t-i) + e_t, stationary from its begin on."""
    random = np.random.default_rng(seed)
    noise = random.standard_normal(rows + 1000)
    return lfilter([1.0], [1.0, *(-c for c in coefficients)], noise)[1000:]


def test_finds_the_coefficients_of_a_process():
    found = ArFilter.of([_process(1.2, -0.5)], most=2)
    assert found.predictors[2] == pytest.approx([1.0, -1.2, 0.5], abs=0.05)
    assert found.variances[2] == pytest.approx(1.0, abs=0.1)


def test_episodes_are_not_joined():
    parts = [np.full(200, 1.0), np.full(200, -1.0)]
    random = np.random.default_rng(0)
    noisy = [p + random.standard_normal(200) for p in parts]
    jump = ArFilter.of([np.concatenate(noisy)], most=1)
    assert ArFilter.of(noisy, most=1).variances == pytest.approx(
        jump.variances, rel=0.02
    )


def test_is_as_strong_from_an_episodes_first_row_on():
    """Prais and Winsten's transformation: the first row counts as much as any."""
    rho = 0.9
    parts = [np.sqrt(1 - rho**2) * _process(rho, rows=5, seed=s) for s in range(4000)]
    own = ArFilter((np.ones(1), np.array([1.0, -rho])), (1.0, 1.0 - rho**2))
    whitened = np.array([own(p) for p in parts])
    assert np.mean(whitened**2, axis=0) == pytest.approx(np.ones(5), abs=0.1)
    assert np.corrcoef(whitened.T) == pytest.approx(np.eye(5), abs=0.06)


def test_slow_noise_is_white_after_it():
    slow = np.column_stack([_process(0.95, seed=1), _process(0.7, -0.3, seed=2)])
    settings = SelectionSettings(ar_errors=0.0, cell_power=1.0)
    found = Prewhitening.of(slow, _ONE_EPISODE, np.inf, settings)
    for column in found(slow).T:
        assert np.abs(autocorrelation(column, 5)).max() < 0.06


def test_slowness_is_rather_taken_for_too_great():
    slow = _process(0.9)
    careful = ArFilter.of([slow], 1, errors=2.0).predictors[1][1]
    assert careful < ArFilter.of([slow], 1).predictors[1][1] < -0.85


def test_what_is_sampled_too_often_is_averaged():
    """A residual that a filter has smoothed over 20 rows: means of several rows."""
    white = np.random.default_rng(2).standard_normal((2000, 1))
    smooth = lfilter(np.hanning(40), [1.0], white, axis=0)
    found = Prewhitening.of(smooth, _ONE_EPISODE, np.inf, SelectionSettings())
    rows = 2000 / len(found.episode)
    assert 5 <= rows <= 20
    kept = np.mean(found.cells == 3)
    assert kept == pytest.approx(rows / 2000, rel=0.01)


@pytest.mark.parametrize("noise", [0.02, 0.7])
def test_a_sensors_white_noise_does_not_keep_rows_from_being_averaged(noise):
    """Where columns are smooth; in rows that have nothing to do with the next, it does.

    As where a sensor is read at rest in many poses.
    """
    random = np.random.default_rng(2)
    smooth = lfilter(np.hanning(40), [1.0], random.standard_normal((8000, 2)), axis=0)
    smooth /= smooth.std()
    columns = np.sin(np.outer(np.arange(8000), [0.01, 0.03]))[:, None].repeat(2, axis=1)
    one = np.zeros(8000, dtype=np.int64)
    read = smooth + noise * random.standard_normal((8000, 2))

    def rows(*columns):
        """Returns how many rows a cell has."""
        found = Prewhitening.of(read, one, np.inf, SelectionSettings(), columns)
        return 8000 / len(found.episode)

    assert 5 <= rows(columns) <= 20
    rough = columns + 0.5 * random.standard_normal(columns.shape)
    assert rows(rough) == rows()
    assert rows() == 1 or noise < 0.1


def test_columns_are_filtered_as_residuals_are():
    random = np.random.default_rng(3)
    columns = random.standard_normal((2000, 2, 3))
    residual = columns @ np.array([1.0, -2.0, 0.5])
    slow = np.column_stack([_process(0.95, seed=4)] * 2)
    found = Prewhitening.of(slow, _ONE_EPISODE, np.inf, SelectionSettings())
    assert found(columns) @ np.array([1.0, -2.0, 0.5]) == pytest.approx(found(residual))


def test_a_channel_without_a_residual_is_left_alone():
    found = Prewhitening.of(
        np.zeros((2000, 1)), _ONE_EPISODE, np.inf, SelectionSettings()
    )
    assert not found(np.zeros((2000, 1))).any()
