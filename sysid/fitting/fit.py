"""A fitted model with effects, and how well its parameters are determined."""

import dataclasses
import functools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as t_distribution

from sysid.fitting.block_grams import (
    BlockGrams,
    NormalEquations,
    blocks_of,
    fold_numbers,
)
from sysid.fitting.candidates import Candidate
from sysid.fitting.settings import SelectionSettings
from sysid.identification.linearisation import Linearisation
from sysid.models.base import LogModel
from sysid.models.simulated_model import simulation_of
from sysid.objective import pseudo_residual
from sysid.parameters import Scaling, nominal_values

Array = NDArray[np.float64]

_BOUND = 1e-6  # of a parameter's range: within this of a bound it is at the bound
_NOTICEABLE = 0.3  # times a stated noise: what is below is of no consequence
_UNDETERMINED = 1e-6  # of the largest singular value: nothing fixes such a direction


@dataclass(frozen=True)
class Fit:
    """A fitted model with effects.

    Attributes:
        effects: that were added.
        model: with their parameters.
        theta: (p,) values of the parameters.
        linearisation: residuals and derivatives there.
        objective: rms residual in units of the noise, Huber's beyond `huber_delta`.
        settings: thresholds.
        noise_is_stated: whether the objective is in units of a noise that is known; of
            one that was estimated from a fit, it is about 1 whatever is missing.
    """

    effects: tuple[Candidate, ...]
    model: LogModel
    theta: Array
    linearisation: Linearisation
    objective: float
    settings: SelectionSettings
    noise_is_stated: bool = True

    @property
    def loss(self) -> float:
        """Sum of the squared residuals, Huber's beyond `huber_delta`."""
        return float(np.sum(self.bounded_residual**2))

    @property
    def bounded_residual(self) -> Array:
        """Residuals (rows, channels) whose squares add up to the loss."""
        return self._bounded(self.linearisation.residual)

    def _bounded(self, residual: Array) -> Array:
        return pseudo_residual(residual, self.linearisation.huber_delta)

    @property
    def states_model_error(self) -> bool:
        """Whether it is known by how much the model itself is off."""
        return self.model.measurements.model_error is not None

    def noticeable(self, channel: int) -> float:
        """Returns the rms, in units of sigma, below which a finding is none.

        What is far below a known noise is the solver's own, whatever it looks like; and
        a model that states by how much it is off itself is off in some pattern.
        """
        if not self.noise_is_stated:
            return 0.0
        share = self.model.measurements.model_error_share[:, channel]
        own = self.settings.model_error_reach * float(np.sqrt(np.mean(share**2)))
        return max(_NOTICEABLE, own)

    @property
    def is_at_noise(self) -> bool:
        """Whether the noise is stated, and the residual of no channel is larger.

        Or no larger than it and what the model does not know of how steps begin; that
        is not asked of a fit that is far off. Of a log of the twin, whose poses are
        exact, half of the channels are silent.
        """
        if not self.noise_is_stated:
            return False
        if self._is_noise(self.bounded_residual):
            return True
        is_far = self.objective > self.settings.max_linear_objective
        return not is_far and self._is_noise(self._bounded(self.weighed_residual))

    def _is_noise(self, bounded: Array) -> bool:
        """Returns whether bounded residuals (rows, channels) are no more than noise."""
        limits, squared = self.settings, bounded**2
        worst = np.sqrt(np.mean(squared, axis=0)).max(initial=0.0)
        level = float(np.sqrt(np.mean(squared)))
        return bool(
            level <= limits.noise_level and worst <= limits.max_objective_at_noise
        )

    @functools.cached_property
    def weighed_residual(self) -> Array:
        """Residuals (rows, channels) in units of all that is known to be uncertain.

        Of the stated error, and of what predictions depend on that no reading shows,
        see `SimulatedModel.begin_error`. A fit does not weigh by the latter: whatever
        makes predictions uncertain would then fit well.
        """
        residual, simulation = self.linearisation.residual, simulation_of(self.model)
        error = simulation.begin_error(self.theta) if simulation else None
        return residual if error is None else residual / np.hypot(1.0, error)

    @property
    def blocks(self) -> NDArray[np.int64]:
        """Number of the block (rows,) of each row."""
        return blocks_of(self.model.measurements.episode, self.settings.blocks)

    @functools.cached_property
    def equations(self) -> NormalEquations:
        """Its normal equations, by blocks."""
        linear, episode = self.linearisation, self.model.measurements.episode
        grams = BlockGrams.of(
            [linear.jacobian],
            linear.residual,
            linear.weights,
            self.blocks,
            episode,
            np.zeros((len(linear.u), 2)),
            pooled=True,
        )
        return grams.weighted(np.ones(1))

    @property
    def half_intervals(self) -> Array:
        """Half the 95 % interval (p,) of each parameter in the unit box.

        By Student's t and the jackknife over folds, see `NormalEquations.covariance`.
        """
        if not len(self.theta):
            return np.zeros(0)
        return self.half_interval_factor * np.sqrt(np.diagonal(self.covariance))

    @property
    def covariance(self) -> Array:
        """Of the parameters (p, p) in the unit box, see `NormalEquations`."""
        folds = self.equations.folds(self.settings.folds)
        return folds.covariance(np.arange(len(self.theta)))

    @property
    def half_interval_factor(self) -> float:
        """Half a 95 % interval in standard errors: Student's t."""
        folds = self.equations.folds(self.settings.folds)
        return float(t_distribution.ppf(0.975, folds.degrees_of_freedom))

    @functools.cached_property
    def held_out_losses(self) -> Array:
        """Loss of each fold and channel (F, C), all parameters fitted to other folds.

        But those that a bound holds: past it the model does not go.
        """
        numbers, linear = np.flatnonzero(~self.is_at_bound), self.linearisation
        folds = self.equations.folds(self.settings.folds)
        changes = np.zeros((len(folds.rows), len(linear.u)))
        changes[:, numbers] = folds.fitted_to_others(numbers)
        fold = fold_numbers(len(self.equations.rows), self.settings.folds)[self.blocks]
        left = linear.residual + np.einsum("rcp,rp->rc", linear.jacobian, changes[fold])
        squares = linear.weights * left**2
        return np.array([squares[fold == f].sum(axis=0) for f in range(len(changes))])

    @property
    def values(self) -> dict[str, float]:
        """The parameters' values, by name."""
        names = [p.name for p in self.model.parameters]
        return dict(zip(names, self.theta.tolist(), strict=True))

    def columns_of(self, effect: Candidate) -> NDArray[np.int64]:
        """Returns which of the parameters are an effect's amplitudes."""
        return self._columns(effect, effect.fields)

    def _columns(self, effect: Candidate, fields: Iterable[str]) -> NDArray[np.int64]:
        names = [f"{effect.name}.{field}" for field in fields]
        own = [i for i, p in enumerate(self.model.parameters) if p.name in names]
        return np.array(own, dtype=np.int64)

    @property
    def is_at_bound(self) -> NDArray[np.bool_]:
        """Which parameters (p,) are at a bound: their value is none of their own."""
        u = self.linearisation.u
        return np.asarray((u < _BOUND) | (u > 1.0 - _BOUND))

    def without_unphysical(self, known: int) -> tuple[Candidate, ...]:
        """Returns its effects, those after the first few without amplitudes at null.

        And without those that have been driven to a bound.

        Args:
            known: number of the effects that keep all amplitudes.
        """
        which, new = self.is_at_bound, []
        for effect in self.effects[known:]:
            pairs = zip(effect.fields, self.columns_of(effect), strict=True)
            if fields := [field for field, column in pairs if not which[column]]:
                new.append(effect.only(fields))
        return (*self.effects[:known], *new)

    @property
    def effect_gains(self) -> dict[str, float]:
        """What each effect gains, by its name, see `gains_of`."""
        return self.gains_of(self.effects)

    def gains_of(self, effects: Sequence[Candidate]) -> dict[str, float]:
        """Returns what each of some of its effects gains, the others left out.

        As a share of the loss without it, of blocks that are not fitted; all other
        parameters are fitted again, one Gauss-Newton step away.
        """
        gone = [self.columns_of(each) for each in self.effects if each not in effects]
        absent = np.concatenate([np.array([], np.int64), *gone])
        present = np.setdiff1d(np.arange(len(self.theta)), absent)
        found = {}
        for effect in effects:
            columns = self.columns_of(effect)
            rest = np.setdiff1d(present, columns)
            equations = self._at_null(np.append(columns, absent))
            without = equations.projected(rest).folds(self.settings.folds)
            found[effect.name] = without.held_out_gain(columns)
        return found

    def _at_null(self, columns: NDArray[np.int64]) -> NormalEquations:
        """Returns the normal equations with some parameters at null."""
        u = self.linearisation.u
        change = np.zeros(len(u))
        change[columns] = (self.null - u)[columns]
        to = np.eye(len(u) + 1)
        to[:-1, -1] = change
        blocks = to.T @ self.equations.blocks @ to
        return dataclasses.replace(self.equations, blocks=blocks)

    @property
    def error_of_model(self) -> Array:
        """By how much the estimate (p,) may be off, in the unit box, for its model.

        Were that off in each row by `model_error_reach` standard deviations to the side
        that matters: the same in all episodes, so that no interval of rows sees it.
        """
        if not self.states_model_error:
            return np.zeros_like(self.theta)
        share = self.model.measurements.model_error_share
        off = np.sqrt(self.linearisation.weights) * share
        reach = self.settings.model_error_reach
        return np.asarray(reach * np.abs(self._step) @ off.reshape(-1))

    @property
    def _step(self) -> Array:
        """What weighted residuals (rows channels,) move the estimate by (p, ...)."""
        linear = self.linearisation
        J = np.sqrt(linear.weights).reshape(-1, 1) * linear.flat_jacobian
        return np.asarray(np.linalg.pinv(J, rcond=_UNDETERMINED))

    @property
    def null(self) -> Array:
        """The point (p,) of the unit box at which no parameter has an effect."""
        parameters = self.model.parameters
        return Scaling(parameters).to_unit(nominal_values(parameters))
