"""What a model expects of a log, before anything is fitted in earnest."""

import abc
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sysid.data_checks.settings import DataSettings
from sysid.models.base import Array, LogModel
from sysid.objective import FAILED_RESIDUAL, Objective
from sysid.parameters import nominal_values
from sysid.workers import Workers

_RANK = 1e-10  # of the largest eigenvalue of the columns' scaled products
_EXACT = 1e-6  # of a channel's spread: what is left of a log without noise
_STEP = 1e-2  # of a parameter's range; predictions are affine in it


class Expectation(abc.ABC):
    """What is left of measured values when a model has explained what it can.

    Attributes:
        model: of all rows.
        rows: (n,) those of the model's rows that are looked at.
        nominal: (n, channels) the prediction there at the nominal parameters, SI.
        scale: (channels,) in units of which residuals are: the noise that is stated,
            or else the channel's own rms residual.
    """

    model: LogModel
    rows: NDArray[np.int64]
    nominal: Array
    scale: Array

    @abc.abstractmethod
    def residual(self, values: Array) -> Array:
        """Returns what the model does not explain (n, channels), in the scale's units.

        Args:
            values: (n, channels) measured at `rows`, SI.
        """

    @abc.abstractmethod
    def all_residuals(self) -> Array:
        """Returns the same of what was measured, at all rows of the model."""


class SimulatedExpectation(Expectation):
    """Of a model that simulates: its prediction at the nominal parameters."""

    def __init__(self, model: LogModel, workers: Workers) -> None:
        """Simulates all rows once; those that fail are not looked at."""
        self.model = model
        objective = Objective(model, workers)
        residual = objective.residuals(nominal_values(model.parameters))[0]
        self._predicted = objective.predicted(residual)
        self.rows = np.flatnonzero((np.abs(residual) < FAILED_RESIDUAL).all(axis=1))
        self.nominal = self._predicted[self.rows]
        self.scale = model.measurements.noise

    def residual(self, values: Array) -> Array:
        """See Expectation."""
        return (values - self.nominal) / self.scale

    def all_residuals(self) -> Array:
        """See Expectation; zero where the simulation failed."""
        residual = np.zeros_like(self._predicted)
        residual[self.rows] = self.residual(self.model.measurements.values[self.rows])
        return residual


class FittedExpectation(Expectation):
    """Of an affine model: the fit to whatever values, and friction, by least squares.

    Each channel may have an offset, and, where the model knows the velocity of its
    joint, viscous and dry friction: an arm has these, and its nominal model does not.
    """

    def __init__(
        self,
        model: LogModel,
        settings: DataSettings,
        live: NDArray[np.bool_] | None = None,
    ) -> None:
        """Builds the model's columns at some rows.

        Args:
            model: affine.
            settings: thresholds.
            live: (channels,) those that are fitted; all if left out.
        """
        self.model = model
        measured = model.measurements
        self._live = np.ones(len(measured.channels), bool) if live is None else live
        self.rows = _spread_rows(measured.episode, settings)
        mask = np.isin(np.arange(measured.rows), self.rows)
        self._theta, self._steps = _steps_of(model)
        thin = model.of_rows(mask)
        self.nominal = thin.predictions(self._theta)
        columns = [
            thin.predictions(self._theta + step) - self.nominal for step in self._steps
        ]
        shape = (*self.nominal.shape, 0)
        own = np.stack(columns, axis=-1) if columns else np.zeros(shape)
        self._thin = thin
        self._columns = np.concatenate([own, _friction(thin)], axis=-1)
        self.scale = np.ones(len(measured.channels))
        values = measured.values[self.rows]
        self._scale_by(_rms(values - values.mean(axis=0)))
        left = _rms(self.residual(values))
        self._scale_by(np.maximum(left, _EXACT) * self.scale)

    def friction(self, channel: int) -> Array:
        """Returns a channel's offset and friction (n, k) at `rows`, of unit size."""
        return _friction_of(self._thin, channel)

    def columns(self, channel: int) -> Array:
        """Returns all that the fit may have of a channel (n, k) at `rows`."""
        found = self._columns[:, channel]
        return found[:, found.any(axis=0)]

    def _scale_by(self, scale: Array) -> None:
        """Sets the scale, with its inverse products of the columns."""
        self.scale = np.maximum(scale, 1e-12)
        weight = np.where(self._live, 1.0 / self.scale, 0.0)
        A = (self._columns * weight[None, :, None]).reshape(-1, self._columns.shape[-1])
        norm = np.linalg.norm(A, axis=0)
        size = np.where(norm > 0.0, norm, 1.0)
        self._A, self._size, self._weight = A / size, size, weight
        self._inverse = np.linalg.pinv(self._A.T @ self._A, _RANK, hermitian=True)

    def _coefficients(self, values: Array) -> Array:
        """Returns the least-squares coefficients (k,) of values (n, channels)."""
        flat = ((values - self.nominal) * self._weight).reshape(-1)
        found: Array = self._inverse @ (self._A.T @ flat) / self._size
        return found

    def residual(self, values: Array) -> Array:
        """See Expectation."""
        explained = self.nominal + self._columns @ self._coefficients(values)
        return np.asarray((values - explained) / self.scale)

    @cached_property
    def _fitted(self) -> Array:
        """Coefficients (k,) of what was measured."""
        return self._coefficients(self.model.measurements.values[self.rows])

    def fitted(self) -> Array:
        """Returns the fit to what was measured at all rows (rows, channels), SI."""
        count, size = len(self._steps), len(self._theta)
        theta = self._theta + self._fitted[:count] @ self._steps.reshape(count, size)
        found = self.model.predictions(theta)
        rest = self._fitted[count:]
        for channel in range(found.shape[1]):
            own = _friction_of(self.model, channel)
            found[:, channel] += own @ rest[: own.shape[1]]
            rest = rest[own.shape[1] :]
        return found

    def all_residuals(self) -> Array:
        """See Expectation."""
        return (self.model.measurements.values - self.fitted()) / self.scale


def expectation_of(
    model: LogModel, settings: DataSettings, workers: Workers
) -> Expectation:
    """Returns what a model expects of its log: by a fit if that is linear."""
    if model.affine:
        return FittedExpectation(model, settings)
    return SimulatedExpectation(model, workers)


def _spread_rows(
    episode: NDArray[np.int64], settings: DataSettings
) -> NDArray[np.int64]:
    """Returns rows that are spread evenly, none of them near an episode's end.

    Of episodes that are too short for that, all rows.
    """
    begin = np.flatnonzero(np.diff(episode, prepend=-1))
    length = np.diff(np.append(begin, len(episode)))
    place = np.arange(len(episode)) - begin[episode]
    margin = settings.most_shift
    inside = (place >= margin) & (place < length[episode] - margin)
    rows = np.flatnonzero(inside)
    if 2 * len(rows) < len(episode):
        rows = np.arange(len(episode))
    return rows[:: -(-len(rows) // settings.most_rows)]


def _steps_of(model: LogModel) -> tuple[Array, Array]:
    """Returns the nominal parameters (p,), and a step of each (p, p)."""
    steps = [_STEP * (p.high - p.low) for p in model.parameters]
    return nominal_values(model.parameters), np.diag(steps)


def _friction(model: LogModel) -> Array:
    """Returns columns (rows, channels, k): offset and friction of each channel."""
    rows, count = model.measurements.values.shape
    parts = [_friction_of(model, channel) for channel in range(count)]
    found = np.zeros((rows, count, sum(part.shape[1] for part in parts)))
    begin = 0
    for channel, part in enumerate(parts):
        found[:, channel, begin : begin + part.shape[1]] = part
        begin += part.shape[1]
    return found


def _friction_of(model: LogModel, channel: int) -> Array:
    """Returns a channel's own columns (rows, k)."""
    offset = np.ones(model.measurements.rows)
    v = model.covariates(channel).get("velocity")
    return np.column_stack([offset] if v is None else [offset, v, np.sign(v)])


def _rms(values: Array) -> Array:
    return np.asarray(np.sqrt(np.mean(values**2, axis=0)))
