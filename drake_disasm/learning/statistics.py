"""Statistics of results over seeds (Agarwal et al., 2021; Wilson, 1927)."""

from collections.abc import Sequence

import numpy as np
from scipy.stats import binomtest


def wilson_interval(successes: int, trials: int) -> tuple[float, float]:
    """Returns Wilson's 95 % interval of a success rate.

    Raises:
        ValueError: no trials, or more successes than trials.
    """
    if not 0 <= successes <= trials or trials == 0:
        raise ValueError(f"{successes} of {trials} is no success rate")
    interval = binomtest(successes, trials).proportion_ci(0.95, method="wilson")
    return float(interval.low), float(interval.high)


def interquartile_mean(values: np.ndarray, axis: int = 0) -> np.ndarray:
    """Returns the mean of the middle half along an axis.

    A quarter of the values, in shares of one where that is no whole number, is
    left out at each end.
    """
    ordered = np.sort(np.moveaxis(np.asarray(values, dtype=float), axis, 0), axis=0)
    return np.tensordot(_middle_weights(len(ordered)), ordered, axes=1)


def _middle_weights(count: int) -> np.ndarray:
    """Returns the share (count,) that each ordered value has in the middle half."""
    edges = np.arange(count + 1) / count
    inside = np.clip(edges, 0.25, 0.75)
    return 2.0 * np.diff(inside)


def bootstrap_interval(
    values: np.ndarray, generator: np.random.Generator, resamples: int = 2000
) -> tuple[np.ndarray, np.ndarray]:
    """Returns the 95 % percentile interval of the interquartile mean over seeds.

    Args:
        values: (seeds, ...) one row per seed; whole seeds are drawn, so what
            belongs together stays together.
        generator: draws the seeds.
        resamples: how many.

    Returns:
        Lower and upper end, each shaped as one row.
    """
    chosen = generator.integers(len(values), size=(resamples, len(values)))
    means = np.stack([interquartile_mean(values[rows]) for rows in chosen])
    low, high = np.quantile(means, (0.025, 0.975), axis=0)
    return low, high


def moving_mean(values: Sequence[float], window: int) -> np.ndarray:
    """Returns the mean of each value and those before it, `window` at most."""
    total = np.concatenate([[0.0], np.cumsum(values)])
    ends = np.arange(1, len(total))
    starts = np.maximum(0, ends - window)
    return (total[ends] - total[starts]) / (ends - starts)
