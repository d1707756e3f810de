"""Does the arm scatter about its commands? An effect on the variance, not the mean.

No prediction gets better by it: residuals are larger than the noise, and that is all.
What tells it from an effect that the library lacks: all channels scatter as if each
step had led elsewhere by itself, and where it led depends on nothing.

In step k the residual is r_k = J_k d_k + n_k, with d_k ~ N(0, S) where the command
truly led, J_k the derivatives of the prediction by that, and n_k the known noise. S is
fitted by maximum likelihood (a random-effects model, Laird and Ware 1982), and J_k
taken anew where each step likely led, since contact is anything but linear.
"""

import dataclasses
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.stats import pearsonr, ttest_1samp, wilcoxon

from sysid.effect_selection.block_regression import blocks_of
from sysid.effect_selection.evidence import ALPHA, LEAST_SHARE
from sysid.effect_selection.fit import Fit
from sysid.identification.whiteness import ljung_box
from sysid.models.base import LogModel
from sysid.objective import Objective, pseudo_residual
from sysid.workers import Workers

Array = NDArray[np.float64]

#: Objective beyond which there is more than noise, where the noise is known.
BEYOND_NOISE = 1.2
_PUSH = 2e-5  # m, of the derivatives
_ROUNDS = 4
_MISSED = 0.02  # of the rows, beyond an edge that a derivative doesn't see
_FOLDS = 8
_UNIT = 1e-4  # m, near the optimum
_LEAST = 1e-3  # of the unit: none
_DEPENDS = 0.01  # family-wise, that where a step led depends on something
_Z95 = 1.959963984540054


@dataclass(frozen=True)
class Scatter:
    """How an arm scatters about its commands.

    Attributes:
        std: (3,) along the axes of G [m].
        interval: (3, 2) 95 %, by the likelihood's curvature.
        gain: share of the loss that it accounts for.
        value: of the objective when it is accounted for, without the few rows in which
            contact came or went.
    """

    std: Array
    interval: Array
    gain: float
    value: float


@dataclass(frozen=True)
class _Likelihood:
    """Residuals r (n, c) of steps as commanded, and J (n, c, 3) by where they led.

    In units of the noise, and of `_UNIT`.
    """

    r: Array
    J: Array
    huber_delta: float

    def rows(self, std: Array) -> tuple[Array, Array]:
        """Returns twice the negative log likelihood (n,), and the squares (n,) in it.

        Squares end at `huber`, row by row.
        """
        M, b, led = self._posterior(std)
        taken = np.einsum("ni,ni->n", b, led)
        squares = np.einsum("nc,nc->n", self.r, self.r) - taken
        channels = self.r.shape[1]
        level = np.sqrt(np.maximum(squares, 0.0) / channels)
        bent = channels * pseudo_residual(level, self.huber_delta) ** 2
        return bent + np.linalg.slogdet(M)[1], bent

    def best(self) -> Array:
        """Returns the standard deviations (3,) that are likeliest."""

        def loss(log: Array) -> float:
            """Returns what is minimised, by the logarithm."""
            return float(self.rows(np.exp(log))[0].sum())

        found = minimize(
            loss,
            np.zeros(3),
            method="L-BFGS-B",
            bounds=[(np.log(_LEAST), np.log(1e3))] * 3,
        )
        std: Array = np.exp(found.x)
        return np.where(std > 2.0 * _LEAST, std, 0.0)

    def led(self, std: Array) -> Array:
        """Returns where steps likely led (n, 3), beside the command."""
        return -std * self._posterior(std)[2]

    def _posterior(self, std: Array) -> tuple[Array, Array, Array]:
        """Returns M (n, 3, 3), b (n, 3) and M^-1 b, in units of `std`.

        The precision of where steps led, what residuals say of it, and its mean.
        """
        JD = self.J * std
        M = np.eye(3) + np.einsum("nci,ncj->nij", JD, JD)
        b = np.einsum("nci,nc->ni", JD, self.r)
        return M, b, np.linalg.solve(M, b[..., None])[..., 0]

    def spread(self, std: Array) -> Array:
        """Returns the standard deviation (3,) of the estimate, axis by axis."""
        step = 0.05 * np.maximum(std, 0.1)
        middle = self.rows(std)[0].sum()
        curvature = [
            (self._moved(std, i, h) + self._moved(std, i, -h) - 2.0 * middle) / h**2
            for i, h in enumerate(step)
        ]
        return np.sqrt(2.0 / np.maximum(curvature, 1e-12))

    def _moved(self, std: Array, axis: int, by: float) -> float:
        away = std + by * (np.arange(3) == axis)
        return float(self.rows(np.abs(away))[0].sum())

    def select(self, mask: NDArray[np.bool_]) -> "_Likelihood":
        """Returns some of the rows."""
        return dataclasses.replace(self, r=self.r[mask], J=self.J[mask])


def scatter(fit: Fit, workers: Workers, huber_delta: float) -> Scatter | None:
    """Returns how an arm scatters, if that is what a fit leaves; else None.

    Args:
        fit: with all effects on the mean.
        workers: to evaluate with.
        huber: where squares end.
    """
    if not fit.model.has_commands or fit.value <= BEYOND_NOISE:
        return None
    led = np.zeros((len(fit.linearisation.residual), 3))
    for _ in range(_ROUNDS):
        seen = _seen(fit, workers, huber_delta, led)
        std = seen.best()
        if not std.any():
            return None
        led = seen.led(std)
    blocks = blocks_of(fit.linearisation, fit.model.measurements.episode)
    if not _carries_over(seen, blocks) or _depends(fit.model, led, std > 0.0):
        return None
    before, after = (seen.rows(s)[1] for s in (np.zeros(3), std))
    usual = after[after <= np.quantile(after, 1.0 - _MISSED)]
    away = _Z95 * seen.spread(std)
    ends = np.stack([np.maximum(std - away, 0.0), std + away], axis=-1)
    return Scatter(
        std * _UNIT,
        ends * _UNIT,
        float(1.0 - after.sum() / before.sum()),
        float(np.sqrt(usual.mean() / seen.r.shape[1])),
    )


def _seen(fit: Fit, workers: Workers, huber_delta: float, led: Array) -> _Likelihood:
    """Returns residuals and derivatives where steps led (n, 3), as from no scatter."""

    def residual(model: LogModel, push: Array) -> Array:
        """Returns the residuals where steps lead by a push (n, 3) further."""
        there = model.displaced(led * _UNIT + push)
        return Objective(there, workers, huber_delta).residuals(fit.theta)[0]

    ways = _PUSH * np.eye(3)[:, None] * np.ones((len(led), 1))
    surrogate = fit.model.surrogate()
    columns = [residual(surrogate, w) - residual(surrogate, -w) for w in ways]
    J = np.stack(columns, axis=-1) * (_UNIT / (2.0 * _PUSH))
    linearisation = residual(fit.model, np.zeros_like(led))
    return _Likelihood(linearisation - np.einsum("nci,ni->nc", J, led), J, huber_delta)


def _carries_over(seen: _Likelihood, blocks: NDArray[np.int64]) -> bool:
    """Returns whether blocks get likelier by a scatter that was fitted to others."""
    gains = np.zeros(int(blocks.max()) + 1)
    folds = blocks % _FOLDS
    for fold in range(_FOLDS):
        own = folds == fold
        if not own.any() or own.all():
            continue
        std = seen.select(~own).best()
        before, after = (seen.select(own).rows(s)[0] for s in (np.zeros(3), std))
        np.add.at(gains, blocks[own], before - after)
    p = float(wilcoxon(gains, alternative="greater").pvalue) if gains.any() else 1.0
    return p < ALPHA and float(np.mean(gains > 0.0)) >= LEAST_SHARE


def _depends(model: LogModel, led: Array, axes: NDArray[np.bool_]) -> bool:
    """Returns whether where steps led (n, 3) follows on anything: then it is no chance.

    On the step before, on a mean, or on what a step began with.
    """
    about = [c for c in model.covariates(0).values() if np.ptp(c) > 0.0]
    p = []
    for d in led[:, axes].T:
        p += [ljung_box(d), float(ttest_1samp(d, 0.0).pvalue)]
        p += [float(pearsonr(d, c).pvalue) for c in about]
    return min(p) * len(p) < _DEPENDS
