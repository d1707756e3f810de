"""Validation and its statistics, against sums by hand, closed forms and SciPy."""

import numpy as np
import pytest

from drake_disasm.learning.evaluation import summed_up
from drake_disasm.learning.statistics import (
    bootstrap_interval,
    interquartile_mean,
    moving_mean,
    wilson_interval,
)
from drake_disasm.mdp import Outcome
from drake_disasm.task.episode import EpisodeSummary


def _summary(reward: float, outcome: Outcome, force: float) -> EpisodeSummary:
    terms = {"progress": reward + 1.0, "force": -1.0}
    return EpisodeSummary(
        seed=0, steps=10, reward_terms=terms, max_force=2 * force, mean_force=force,
        max_torque=0.2, mean_torque=0.1, outcome=outcome,
        bolt_is_out=outcome is Outcome.SUCCESS,
    )  # fmt: skip


def test_figures_are_what_they_say() -> None:
    figures = summed_up([
        _summary(10.0, Outcome.SUCCESS, 1.0),
        _summary(20.0, Outcome.SUCCESS, 2.0),
        _summary(-6.0, Outcome.FORCE_LIMIT, 6.0),
    ])  # fmt: skip
    assert (figures.episodes, figures.successes, figures.truly_out) == (3, 2, 2)
    assert figures.performance == pytest.approx(8.0)
    assert figures.instability == pytest.approx(np.std([10.0, 20.0, -6.0]))
    assert figures.mean_force == pytest.approx(3.0)
    assert figures.peak_force == 12.0 and figures.mean_peak_force == pytest.approx(6.0)
    assert figures.mean_torque == pytest.approx(0.1)
    assert figures.success_low < 2 / 3 < figures.success_high


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
