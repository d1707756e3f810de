"""Does the arm scatter about its commands? An effect on the variance, not the mean.

No prediction gets better by it: residuals are larger than the noise, and that is all.
It differs from an effect that the library lacks in that all channels scatter as if each
step had ended elsewhere at random, and where it ended depends on nothing.

In step k the residual is r_k = J_k d_k + n_k, with d_k ~ N(0, S) the displacement of
the step's end, J_k the derivatives of the prediction by that, and n_k the known noise.
S is fitted by maximum likelihood (a random-effects model, Laird and Ware 1982), and r_k
and J_k are taken anew at the likeliest displacements: contact is anything but linear,
and a step begins where the one before was displaced to, which an arm with inertia and
damping remembers. Where a wall hides the way there from the derivatives, displacements
are drawn from N(0, S).
"""

import dataclasses
import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.stats import pearsonr, ttest_1samp, wilcoxon

from sysid.confidence import Z
from sysid.fitting.fit import Fit
from sysid.fitting.fitter import Fitter
from sysid.identification.whiteness import ljung_box
from sysid.models.simulated_model import SimulatedModel, simulation_of
from sysid.objective import Objective, pseudo_residual

Array = NDArray[np.float64]

# Steps of the likelihood's second differences, not thresholds.
_CURVATURE_STEP = 0.05  # of a standard deviation
_LEAST_SIZE = 0.1  # of the scale: the least size that the step is taken of

_SCALE = 1e-4  # m, the unit of the search: the repeatability that arms declare
_STEP = 2e-5  # m, of the derivatives by where a step led: encoders' repeatability
_ROUNDS = 8  # derivatives are taken anew where steps likely led
_PROGRESS = 0.01  # of the scale: an iteration that changes less is the last
_DRAWS = 8  # trials of where a step led that is missed by far
_MISSED = 2.0  # of the channels' number: noise alone loses 1 on average
_EDGE_SHARE = 0.02  # rows that may lie beyond an edge that no derivative sees
_FOLDS = 8
_LEAST = 1e-3  # of the scale: a standard deviation of less is none
_MOST = 1e3
_LEAST_AXIS = 0.15  # of the axis that scatters most
_ALPHA = 0.01  # stricter than usual: many covariates are asked of each axis


@dataclass(frozen=True)
class CommandScatter:
    """How an arm scatters about its commands.

    Attributes:
        std: (3,) along the axes of G [m].
        interval: (3, 2) 95 %, by the likelihood's curvature [m].
        gain: share of the loss that it accounts for.
        objective: with it accounted for, without the few rows in which contact came or
            went.
        residual: (rows, channels) that it leaves, in units of the noise: of unit
            covariance, if nothing else is missing; 0 in those few rows.
    """

    std: Array
    interval: Array
    gain: float
    objective: float
    residual: Array

    def left_of(self, fit: Fit) -> Fit:
        """Returns the fit that it was found in, with what it leaves of the residual."""
        linear = dataclasses.replace(fit.linearisation, residual=self.residual)
        return dataclasses.replace(fit, linearisation=linear)


@dataclass(frozen=True)
class _Likelihood:
    """Residuals r (n, c) of steps as commanded, and J (n, c, 3) by displacements.

    In units of the noise, and of `scatter_scale`.
    """

    r: Array
    J: Array
    huber_delta: float

    def rows(self, std: Array) -> tuple[Array, Array]:
        """Returns twice the negative log likelihood (n,), and the squares (n,) in it.

        A row's rms residual is huberised as by Huber's loss.
        """
        M, b, mean = self._posterior(std)
        taken = np.einsum("ni,ni->n", b, mean)
        squares = np.einsum("nc,nc->n", self.r, self.r) - taken
        channels = self.r.shape[1]
        level = np.sqrt(np.maximum(squares, 0.0) / channels)
        huberised = channels * pseudo_residual(level, self.huber_delta) ** 2
        return huberised + np.linalg.slogdet(M)[1], huberised

    def best(self) -> Array:
        """Returns the standard deviations (3,) of the greatest likelihood.

        Those of axes that scatter little beside another are 0: the derivatives are not
        right so far from where they were taken.
        """

        def loss(log: Array) -> float:
            """Returns what is minimised, by the logarithm."""
            return float(self.rows(np.exp(log))[0].sum())

        ends = (np.log(_LEAST), np.log(_MOST))
        found = minimize(loss, np.zeros(3), method="L-BFGS-B", bounds=[ends] * 3)
        std: Array = np.exp(found.x)
        least = max(2.0 * _LEAST, _LEAST_AXIS * std.max())
        return np.where(std > least, std, 0.0)

    def whitened(self, std: Array) -> Array:
        """Returns the residuals (n, c) less what scatter makes them vary together.

        C^(-1/2) r with their covariance C = J S J' + 1. The symmetric root, so that
        each channel stays as near to itself as can be (Kessy, Lewin, Strimmer 2018).
        """
        JD = self.J * std
        C = np.eye(self.r.shape[1]) + np.einsum("nci,ndi->ncd", JD, JD)
        values, axes = np.linalg.eigh(C)
        along = np.einsum("nci,nc->ni", axes, self.r) / np.sqrt(values)
        return np.asarray(np.einsum("nci,ni->nc", axes, along))

    def displacements(self, std: Array) -> Array:
        """Returns the likeliest displacement of each step (n, 3)."""
        return -std * self._posterior(std)[2]

    def _posterior(self, std: Array) -> tuple[Array, Array, Array]:
        """Returns M (n, 3, 3), b (n, 3) and M^-1 b, in units of `std`.

        The displacements' precision, their information vector, and their mean.
        """
        JD = self.J * std
        M = np.eye(3) + np.einsum("nci,ncj->nij", JD, JD)
        b = np.einsum("nci,nc->ni", JD, self.r)
        return M, b, np.linalg.solve(M, b[..., None])[..., 0]

    def standard_errors(self, std: Array) -> Array:
        """Returns the standard error (3,) of the estimate, axis by axis."""
        step = _CURVATURE_STEP * np.maximum(std, _LEAST_SIZE)
        middle = self.rows(std)[0].sum()
        curvature = [
            (self._shifted(std, i, h) + self._shifted(std, i, -h) - 2.0 * middle) / h**2
            for i, h in enumerate(step)
        ]
        return np.sqrt(2.0 / np.maximum(curvature, 1e-12))

    def _shifted(self, std: Array, axis: int, by: float) -> float:
        away = std + by * (np.arange(3) == axis)
        return float(self.rows(np.abs(away))[0].sum())

    def select(self, mask: NDArray[np.bool_]) -> "_Likelihood":
        """Returns some of the rows."""
        return dataclasses.replace(self, r=self.r[mask], J=self.J[mask])


def fit_command_scatter(fitter: Fitter, fit: Fit) -> CommandScatter | None:
    """Returns how an arm scatters, if that is what a fit leaves; else None.

    Args:
        fitter: its workers evaluate.
        fit: with all effects on the mean.
    """
    at_noise = fit.objective <= fitter.settings.max_objective_at_noise
    model = simulation_of(fit.model)
    if model is None or at_noise:
        return None
    begin = _Steps(fitter, fit, model, np.zeros((len(fit.linearisation.residual), 3)))
    likelihood, displacement = _likeliest(begin)
    std = likelihood.best()
    if not std.any() or not _generalises(likelihood, fit.blocks):
        return None
    if _is_dependent(fit, displacement[:, std > 0.0]):
        return None
    return _summary(likelihood, std)


def _likeliest(steps: "_Steps") -> tuple[_Likelihood, Array]:
    """Returns the likelihood where steps likely led, and where that is (n, 3)."""
    random = np.random.default_rng(0)
    likelihood, before = steps.likelihood(), np.full(3, np.inf)
    for _ in range(_ROUNDS):
        std = likelihood.best()
        progress = float(np.abs(std - before).max())
        if not std.any() or progress < _PROGRESS:
            break
        target = likelihood.displacements(std)
        steps = steps.improved(std, target, random)
        likelihood, before = steps.likelihood(), std
    return likelihood, steps.displacement


def _summary(likelihood: _Likelihood, std: Array) -> CommandScatter:
    """Returns a scatter (3,) with its interval and what it explains."""
    before, after = (likelihood.rows(s)[1] for s in (np.zeros(3), std))
    is_usual = after <= np.quantile(after, 1.0 - _EDGE_SHARE)
    away = Z * likelihood.standard_errors(std)
    ends = np.stack([np.maximum(std - away, 0.0), std + away], axis=-1)
    return CommandScatter(
        std * _SCALE,
        ends * _SCALE,
        float(1.0 - after.sum() / before.sum()),
        float(np.sqrt(after[is_usual].mean() / likelihood.r.shape[1])),
        likelihood.whitened(std) * is_usual[:, None],
    )


@dataclass(frozen=True)
class _Steps:
    """Steps of a fit as they were likely executed.

    Attributes:
        fitter, fit, model: whose rows they are.
        displacement: (n, 3) where they ended, in units of `scatter_scale`.
    """

    fitter: Fitter
    fit: Fit
    model: SimulatedModel
    displacement: Array

    def likelihood(self) -> _Likelihood:
        """Returns residuals without scatter, and derivatives there."""
        r = self._here
        step = _STEP / _SCALE
        ways = step * np.eye(3)[:, None] * np.ones((len(r), 1))
        surrogate = self.model.surrogate()
        columns = [
            self._residual(surrogate, self.displacement + w)
            - self._residual(surrogate, self.displacement - w)
            for w in ways
        ]
        J = np.stack(columns, axis=-1) / (2.0 * step)
        r = r - np.einsum("nci,ni->nc", J, self.displacement)
        return _Likelihood(r, J, self.fitter.huber_delta)

    def improved(
        self, std: Array, target: Array, random: np.random.Generator
    ) -> "_Steps":
        """Returns steps that are likelier, each by the best of some trials.

        Args:
            std: (3,) standard deviations of their ends.
            target: (n, 3) the likeliest displacements, were the steps linear.
            random: draws others, for steps that are missed by far.
        """
        found, all_rows = self.displacement.copy(), np.ones(len(target), bool)
        offset = self._surrogate_offset()
        least = self._losses(self._here, found, std)
        for i in range(_DRAWS):
            missed = least > _MISSED * self._channels
            rows = missed if i else all_rows
            if not rows.any():
                break
            draws = std * random.standard_normal(target.shape)
            trial = draws if i else target
            r = self._residual(self.model.surrogate(), trial, rows) + offset[rows]
            losses = self._losses(r, trial[rows], std)
            better = np.flatnonzero(rows)[losses < least[rows]]
            least[rows] = np.minimum(least[rows], losses)
            found[better] = trial[better]
        return dataclasses.replace(self, displacement=found)

    def _losses(self, r: Array, ends: Array, std: Array) -> Array:
        """Returns the losses (m,) of steps with residuals (m, c) and ends (m, 3)."""
        level = np.sqrt(np.mean(r**2, axis=1))
        huberised = pseudo_residual(level, self.fitter.huber_delta) ** 2
        least = _LEAST
        unlikely = ends / np.maximum(std, least)
        return self._channels * huberised + np.sum(unlikely**2, axis=1)

    def _surrogate_offset(self) -> Array:
        """Returns residuals (n, c) less those that the surrogate leaves."""
        surrogate = self.model.surrogate()
        if surrogate is self.model:
            return np.zeros_like(self._here)
        return self._here - self._residual(surrogate, self.displacement)

    @functools.cached_property
    def _here(self) -> Array:
        """Residuals (n, c) as displaced: of a costly model they take seconds."""
        return self._residual(self.model, self.displacement)

    def _residual(
        self, model: SimulatedModel, ends: Array, rows: NDArray[np.bool_] | None = None
    ) -> Array:
        """Returns residuals (n, c) of steps that end elsewhere (n, 3), from here on."""
        scale = _SCALE
        there = model.with_displacement(
            self.displacement * scale, (ends - self.displacement) * scale
        )
        if rows is not None:
            there = there.of_rows(rows)
        objective = Objective(there, self.fitter.workers, self.fitter.huber_delta)
        return objective.residuals(self.fit.theta)[0]

    @property
    def _channels(self) -> int:
        return self.fit.linearisation.residual.shape[1]


def _generalises(likelihood: _Likelihood, blocks: NDArray[np.int64]) -> bool:
    """Returns whether blocks get likelier by a scatter that was fitted to others."""
    gains = np.zeros(int(blocks.max()) + 1)
    folds = blocks % _FOLDS
    for fold in range(_FOLDS):
        own = folds == fold
        if not own.any() or own.all():
            continue
        std = likelihood.select(~own).best()
        before, after = (likelihood.select(own).rows(s)[0] for s in (np.zeros(3), std))
        np.add.at(gains, blocks[own], before - after)
    if not gains.any():
        return False
    return float(wilcoxon(gains, alternative="greater").pvalue) < _ALPHA


def _is_dependent(fit: Fit, displacement: Array) -> bool:
    """Returns whether displacements (n, axes) depend on anything: then no scatter.

    On the step before, on a mean, or on what a step began with.
    """
    covariates = [c for c in fit.model.covariates(0).values() if np.ptp(c) > 0.0]
    p = []
    for d in displacement.T:
        p += [ljung_box(d), float(ttest_1samp(d, 0.0).pvalue)]
        p += [float(pearsonr(d, c).pvalue) for c in covariates]
    return min(p) * len(p) < _ALPHA
