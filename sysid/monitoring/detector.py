"""When the mean of some statistics has shifted: an e-detector over unknown scatter.

A statistic x_n of each episode has, without a change, an unknown mean and an unknown
variance. Whether its mean has shifted since episode j is a two-sample comparison: with
n episodes before j and m since, nu = n + m - 2, n_e = 1 / (1/n + 1/m) and the pooled
two-sample t, the Bayes factor for a shift of delta standard deviations, delta normal
with standard deviation tau, is (Gonen, Johnson, Lu and Westfall 2005)

    BF_j = (1 + n_e tau^2)^(-1/2)
           [(1 + t^2 / nu) / (1 + t^2 / (nu (1 + n_e tau^2)))]^((nu + 1) / 2).

Of independent normal episodes it is a likelihood ratio of what does not depend on mean
and variance, and so an e-process whatever these are (Perez-Ortiz, Lardy, de Heide and
Gruenwald 2024). Its sum over all starts j, averaged over the statistics,

    R_n = sum_k w_k sum_j BF_j^k(n),    sum_k w_k = 1,

grows by one per episode on average: an alarm at R_n >= A comes after A episodes or
more, on average, if nothing has changed (Shiryaev-Roberts; Shin, Ramdas and Rinaldo
2024). A start that is an episode old counts one at most: one odd episode raises no
alarm by itself. Dropping the oldest starts, too, only makes R smaller.

Episodes are taken to be independent of each other. They need not be normal:
what is further than `CLIPPED` robust standard deviations from the median counts as if
it were just there. Of A = 1000 stated, one statistic keeps 3800 measured episodes if
it is normal, 3300 with Student's t of 4 degrees of freedom (400 without clipping), and
90 if each episode is correlated with the next by 0.5. Many statistics that are so
correlated raise alarms still sooner: a gear that warms up over several episodes is no
robot in good order.
"""

import dataclasses
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp
from scipy.stats import t as t_distribution

Array = NDArray[np.float64]

#: Prior standard deviation of a shift, in standard deviations between episodes: shifts
#: of one are hidden in the scatter, those of ten are found at once whatever the prior.
SHIFT = 3.0
#: Starts that are kept, and so many episodes before them: what grows by less than the
#: scatter within so many episodes is not found by more of them.
WINDOW = 200
#: Robust standard deviations: heavy tails then raise no more false alarms than normal
#: ones, and a shift of four is found one episode later.
CLIPPED = 3.0
_MAD = 1.4826  # normal standard deviations in a median absolute deviation


@dataclass(frozen=True)
class Evidence:
    """How surely statistics have shifted.

    Attributes:
        log_total: log R_n, over all statistics.
        log_each: (K,) log of the sum over starts of each statistic.
    """

    log_total: float
    log_each: Array


@dataclass(frozen=True)
class Shift:
    """How far a statistic has shifted.

    Attributes:
        value: mean since the start less the mean before.
        interval: 95 %, by Student's t.
        age: number of episodes since the start, which counts.
    """

    value: float
    interval: tuple[float, float]
    age: int


@dataclass(frozen=True)
class ShiftDetector:
    """The last episodes' K statistics, and what is found in them.

    Attributes:
        weights: (K,) of the statistics; their sum is one.
        floors: (K,) standard deviations below which scatter is rounding.
        history: (h, K) episodes, the oldest first; NaN where an episode does not show a
            statistic.
        starts: number of the last ones at which a shift may have begun.
    """

    weights: Array
    floors: Array
    history: Array
    starts: int = 0

    def with_reference(self, x: Array) -> Self:
        """Returns the detector after one more episode (K,) that is in order."""
        return dataclasses.replace(self, history=np.vstack([self.history, x]))

    def added(self, x: Array) -> Self:
        """Returns the detector after one more episode (K,)."""
        history = np.vstack([self.history, x])[-2 * WINDOW :]
        starts = min(self.starts + 1, WINDOW)
        return dataclasses.replace(self, history=history, starts=starts)

    def evidence(self) -> Evidence:
        """Returns the evidence for a shift since any of the last episodes."""
        if not self.starts:
            nothing = np.full(len(self.weights), -np.inf)
            return Evidence(-np.inf, nothing)
        n, m, difference, variance = self._two_samples(self._clipped())
        starts = log_bayes_factor(n, m, difference, np.sqrt(variance))
        starts = np.where(m < 2, np.minimum(starts, 0.0), starts)
        each = logsumexp(starts, axis=0)
        total = float(logsumexp(each, b=self.weights))
        return Evidence(total, each)

    def start(self, number: int) -> int:
        """Returns the most likely start of a statistic's shift, from 0.

        By the values as they are: clipped ones are too much like the scatter before.
        """
        n, m, difference, variance = self._two_samples_of(number)
        found = log_bayes_factor(n, m, difference, np.sqrt(variance))
        return int(np.argmax(found))

    def shift(self, number: int, start: int) -> Shift:
        """Returns how far a statistic has shifted since a start.

        Args:
            number: of the statistic.
            start: number of the start, from 0.
        """
        parts = self._two_samples_of(number)
        n, m, value, variance = (float(part[start]) for part in parts)
        student = t_distribution.ppf(0.975, max(n + m - 2.0, 1.0))
        reach = float(student * np.sqrt(variance * (1.0 / n + 1.0 / m)))
        return Shift(value, (value - reach, value + reach), self.starts - start)

    def _two_samples_of(self, number: int) -> list[Array]:
        """Returns what `_two_samples` does of one statistic, not clipped, (w,) each."""
        own = slice(number, number + 1)
        return [part[:, 0] for part in self._two_samples(self.history[:, own], own)]

    def _clipped(self) -> Array:
        """Returns the history (h, K) without what is far from all else."""
        is_shown = np.isfinite(self.history).any(axis=0)
        known = np.where(is_shown, self.history, 0.0)
        middle = np.nanmedian(known, axis=0)
        away = np.nanmedian(np.abs(known - middle), axis=0)
        reach = np.maximum(CLIPPED * _MAD * away, self.floors)
        return np.clip(self.history, middle - reach, middle + reach)

    def _two_samples(
        self, history: Array, columns: slice = slice(None)
    ) -> tuple[Array, Array, Array, Array]:
        """Returns of each start (w, K) what the two-sample t is made of.

        Numbers before and since, difference of the means, pooled variance.
        """
        known = np.isfinite(history)
        middle = np.where(known, history, 0.0).sum(axis=0) / np.maximum(
            known.sum(axis=0), 1
        )
        x = np.where(known, history - middle, 0.0)
        since = (np.cumsum(part[::-1], axis=0)[::-1] for part in (1.0 * known, x, x**2))
        m, after, after_square = since
        n, before, square = m[0] - m, after[0] - after, after_square[0] - after_square
        of_n, of_m = np.maximum(n, 1.0), np.maximum(m, 1.0)
        within = square - before**2 / of_n + after_square - after**2 / of_m
        variance = np.maximum(within, 0.0) / np.maximum(n + m - 2.0, 1.0)
        variance = np.maximum(variance, self.floors[columns] ** 2)
        found = (n, m, after / of_m - before / of_n, variance)
        begin = len(history) - self.starts
        n, m, difference, variance = (part[begin:] for part in found)
        return n, m, difference, variance


def log_bayes_factor(n: Array, m: Array, difference: Array, deviation: Array) -> Array:
    """Returns the logarithm of the Bayes factor of a shift, see the module.

    Minus infinity where there is none yet: of no episode since, or one before.

    Args:
        n, m: numbers of episodes before and since.
        difference: of the means.
        deviation: pooled standard deviation.
    """
    is_known = (m >= 1) & (n >= 2)
    n, m = np.maximum(n, 2.0), np.maximum(m, 1.0)
    nu, effective = n + m - 2.0, 1.0 / (1.0 / n + 1.0 / m)
    per_nu = effective * (difference / deviation) ** 2 / nu  # t^2 / nu
    spread = 1.0 + effective * SHIFT**2
    ratio = np.log1p(per_nu) - np.log1p(per_nu / spread)
    found = 0.5 * (nu + 1.0) * ratio - 0.5 * np.log(spread)
    return np.asarray(np.where(is_known, found, -np.inf))
