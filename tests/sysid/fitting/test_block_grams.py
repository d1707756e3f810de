"""Fits, projections, held-out losses and intervals from Gram matrices alone."""

import numpy as np
import pytest
import statsmodels.api as sm
from scipy.signal import lfilter
from scipy.stats import t as t_distribution

from sysid.fitting.block_grams import BlockGrams, blocks_of

_ROWS, _CHANNELS, _P, _BLOCKS = 240, 2, 5, 12
_BASE, _MORE = np.array([0, 1]), np.array([2, 3, 4])


class _Data:
    """Columns, a residual and weights, drawn."""

    def __init__(self, seed=0):
        random = np.random.default_rng(seed)
        self.A = random.standard_normal((_ROWS, _CHANNELS, _P))
        self.A[..., 2] += self.A[..., 0]
        self.r = random.standard_normal((_ROWS, _CHANNELS)) - self.A @ np.arange(_P)
        self.weights = random.uniform(0.1, 1.0, self.r.shape)
        self.episode = np.repeat([0, 1], _ROWS // 2)
        self.blocks = blocks_of(self.episode, _BLOCKS)
        self.of_channels = np.array([1.0, 4.0])

    def grams(self, rows=slice(None)):
        A, parts = self.A[rows], [[0, 1, 2], [3, 4]]
        return BlockGrams.of(
            [A[..., part] for part in parts],
            self.r[rows],
            self.weights[rows],
            self.blocks[rows],
            self.episode[rows],
            np.tile([-np.inf, np.inf], (_P, 1)),
        )

    def equations(self):
        return self.grams().weighted(self.of_channels)

    def scaled(self, rows=slice(None)):
        """Returns A and r whose squares are what is minimised, rows flattened."""
        root = np.sqrt(self.weights * self.of_channels)[rows]
        A = (root[..., None] * self.A[rows]).reshape(-1, _P)
        return A, (root * self.r[rows]).reshape(-1)


@pytest.fixture(scope="module")
def data():
    return _Data()


def _left(A, r):
    """Returns what least squares leave of residuals."""
    return r - A @ np.linalg.lstsq(A, r, rcond=None)[0]


def test_a_fit_is_least_squares(data):
    A, r = data.scaled()
    expected = np.linalg.lstsq(A, -r, rcond=None)[0]
    found = data.equations().solution(np.arange(_P))
    np.testing.assert_allclose(found, expected, rtol=1e-6)


def test_columns_that_are_projected_out_are_fitted_beside_all_others(data):
    """The theorem of Frisch, Waugh and Lovell; block by block for the loss."""
    A, r = data.scaled()
    projected = data.equations().projected(_BASE)
    whole = np.linalg.lstsq(A, -r, rcond=None)[0]
    np.testing.assert_allclose(projected.solution(_MORE), whole[_MORE], rtol=1e-5)
    left = _left(A[:, _BASE], r).reshape(_ROWS, -1)
    losses = np.bincount(data.blocks, np.sum(left**2, axis=1))
    np.testing.assert_allclose(projected.losses, losses, rtol=1e-6)
    assert not projected.is_new(_BASE).any() and projected.is_new(_MORE).all()


def test_each_block_is_predicted_by_a_fit_to_all_others(data):
    expected = []
    for block in range(_BLOCKS):
        A, r = data.scaled(data.blocks != block)
        own_A, own_r = data.scaled(data.blocks == block)
        x = np.linalg.lstsq(A[:, _MORE], -r, rcond=None)[0]
        expected.append(np.sum((own_r + own_A[:, _MORE] @ x) ** 2))
    equations = data.equations()
    np.testing.assert_allclose(equations.held_out(_MORE), expected, rtol=1e-6)
    each = equations.held_out_each()
    for column in range(_P):
        alone = equations.held_out(np.array([column]))
        np.testing.assert_allclose(each[:, column], alone, rtol=1e-6)


def test_a_change_of_coefficients_changes_the_residual(data):
    change = np.linspace(-1.0, 1.0, _P)
    moved = _Data()
    moved.r = moved.r + moved.A @ change
    np.testing.assert_allclose(
        data.grams().shifted(change).grams, moved.grams().grams, rtol=1e-9, atol=1e-9
    )


def test_logs_add_up_and_blocks_can_be_left_out(data):
    halves = [data.grams(data.episode == number) for number in (0, 1)]
    both, whole = halves[0] + halves[1], data.grams()
    np.testing.assert_allclose(both.grams, whole.grams)
    assert (both.rows == whole.rows).all()
    assert np.flatnonzero(np.diff(both.episode)).tolist() == [_BLOCKS // 2 - 1]
    first = whole.select(whole.episode == 0)
    np.testing.assert_allclose(first.grams, halves[0].grams)
    folds = whole.weighted(data.of_channels).folds(3)
    assert len(folds.rows) == 3 and folds.rows.sum() == _ROWS
    np.testing.assert_allclose(folds.total, data.equations().total)


def test_what_is_left_of_each_channel(data):
    """With coefficients that all channels share."""
    root = np.sqrt(data.weights)
    A, r = (root[..., None] * data.A[..., _BASE]).reshape(-1, 2), root * data.r
    left = _left(A, r.reshape(-1)).reshape(_ROWS, _CHANNELS)
    found = data.grams().channel_powers(_BASE)
    np.testing.assert_allclose(found, np.mean(left**2, axis=0), rtol=1e-6)


def test_columns_whose_coefficients_would_leave_their_bounds_are_left_out(data):
    grams, x = data.grams(), data.equations().solution(np.arange(_P))
    bounds = np.tile([-np.inf, np.inf], (_P, 1))
    for most, expected in ((2.0, [0, 1, 2, 3, 4]), (0.5, [0, 1, 2, 4])):
        bounds[3] = sorted([0.0, most * x[3]])
        own = BlockGrams(grams.grams, grams.rows, grams.episode, bounds)
        found = own.weighted(data.of_channels).feasible(np.arange(_P))
        assert found.tolist() == expected


def test_a_coefficient_beyond_the_bound_that_is_not_null_is_kept(data):
    grams, x = data.grams(), data.equations().solution(np.arange(_P))
    bounds = np.tile([-np.inf, np.inf], (_P, 1))
    for bound, expected in ((0.5, [0, 1, 2, 3, 4]), (-0.5, [0, 1, 2, 4])):
        bounds[3] = sorted([0.0, bound * x[3]])
        own = BlockGrams(grams.grams, grams.rows, grams.episode, bounds)
        equations = own.weighted(data.of_channels).bounded_at_null()
        assert equations.feasible(np.arange(_P)).tolist() == expected


def test_blocks_are_contiguous_and_span_episodes_only_where_there_are_many():
    episode = np.repeat(np.arange(5), [10, 200, 30, 5, 55])
    blocks = blocks_of(episode, 48)
    assert set(np.diff(blocks)) <= {0, 1} and 40 <= blocks[-1] + 1 <= 60
    assert all(len(np.unique(episode[blocks == b])) == 1 for b in range(blocks[-1]))
    many = blocks_of(np.repeat(np.arange(100), 3), 48)
    assert many[-1] == 47 and set(np.diff(many)) <= {0, 1}


def _regressions(rho, count, rows=480):
    """Yields regressions on slow columns, with noise that is correlated by rho."""
    random = np.random.default_rng(1)
    t = np.linspace(0.0, 1.0, rows)
    A = np.column_stack([np.ones(rows), np.sin(9.0 * t), np.cos(23.0 * t)])
    white = random.standard_normal((count, rows + 200))
    noise = lfilter([np.sqrt(1 - rho**2)], [1.0, -rho], white)[:, 200:]
    blocks, one = blocks_of(np.zeros(rows, np.int64), 48), np.zeros(rows, np.int64)
    weights = np.ones((rows, 1))
    for r in noise:
        grams = BlockGrams.of(
            [A[:, None, :]], r[:, None], weights, blocks, one, np.zeros((3, 2))
        )
        yield A, r, grams.weighted(np.ones(1))


@pytest.mark.parametrize("rho", [0.0, 0.6])
def test_intervals_cover_the_truth_in_white_and_in_slow_noise(rho):
    columns, count, covered = np.arange(3), 200, np.zeros(3)
    for _, _, blocks in _regressions(rho, count):
        equations = blocks.folds(8)
        error = np.sqrt(np.diagonal(equations.covariance(columns)))
        half = t_distribution.ppf(0.975, equations.degrees_of_freedom) * error
        covered += np.abs(equations.solution(columns)) <= half
    assert 0.92 <= covered.mean() / count <= 0.98


def test_in_white_noise_the_covariance_is_that_of_ordinary_least_squares():
    columns, ratios = np.arange(3), []
    for A, r, equations in _regressions(0.0, 100):
        ordinary = np.diagonal(sm.OLS(r, A).fit().cov_params())
        ratios.append(np.diagonal(equations.covariance(columns)) / ordinary)
    np.testing.assert_allclose(np.mean(ratios, axis=0), 1.0, atol=0.2)
