"""Reported statistics against closed forms and SciPy's values."""

import numpy as np
import pytest

from drake_disasm.learning.statistics import (
    bootstrap_interval,
    interquartile_mean,
    moving_mean,
    wilson_interval,
)


def test_wilson_is_what_the_literature_tabulates() -> None:
    assert wilson_interval(20, 20)[0] == pytest.approx(0.839, abs=1e-3)
    assert wilson_interval(73, 73)[0] == pytest.approx(0.95, abs=1e-3)
    low, high = wilson_interval(7, 10)
    assert (low, high) == pytest.approx((0.3968, 0.8922), abs=1e-4)
    assert wilson_interval(0, 10) == pytest.approx((0.0, 0.2775), abs=1e-4)
    for won, of in ((1, 0), (3, 2), (-1, 5)):
        with pytest.raises(ValueError, match="no success rate"):
            wilson_interval(won, of)


def test_the_interquartile_mean_ignores_the_outer_quarters() -> None:
    assert interquartile_mean(np.array([-1e9, 1.0, 2.0, 1e9])) == pytest.approx(1.5)
    # Ten values: the third and the eighth count half (2.5 to 7.5 of ten).
    expected = (0.5 * 2 + 3 + 4 + 5 + 6 + 0.5 * 7) / 5
    assert interquartile_mean(np.arange(10.0)) == pytest.approx(expected)
    assert interquartile_mean(np.array([3.0])) == pytest.approx(3.0)
    values = np.random.default_rng(0).normal(size=(8, 3))
    columns = [interquartile_mean(values[:, i]) for i in range(3)]
    np.testing.assert_allclose(interquartile_mean(values), columns)


def test_the_bootstrap_interval_covers_the_truth_about_as_often_as_it_says() -> None:
    generator = np.random.default_rng(1)
    hits = 0
    for _ in range(150):
        sample = generator.normal(size=(20, 1))
        low, high = bootstrap_interval(sample, generator, resamples=100)
        hits += bool(low[0] <= 0.0 <= high[0])
    assert 0.85 <= hits / 150 <= 0.99


def test_the_moving_mean_looks_back_only() -> None:
    np.testing.assert_allclose(moving_mean([2.0, 4.0, 6.0, 8.0], 2), [2, 3, 5, 7])
