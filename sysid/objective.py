"""The error between a model and a log: eq. 4.8, weighted by the channels' noise."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drake_disasm.common.errors import DisasmError
from sysid.models.base import Array, LogModel
from sysid.parameters import Scaling, nominal_values
from sysid.workers import Workers

#: Weighted residual where the simulation failed: a million times the noise, worse than
#: any fit, and finite. All others are clipped to it.
FAILED_RESIDUAL = 1e6


class Objective:
    """f(theta) = sqrt(mean (r / sigma)^2), the rms residual in units of the noise.

    It is eq. 4.8's (1/n) ||s'_real - s'_sim||_2 with each channel divided by its
    standard deviation, times a constant, sqrt(n / channels): it ranks parameters
    in the same order, does not depend on the size of the log, and 1 means "as good as
    the sensors". A theta at which the simulation fails counts as FAILED_RESIDUAL in
    every channel of every row.

    With a finite `huber_delta`, the loss is linear beyond that many standard deviations
    (Huber 1964): a transition in which the bolt runs into the stop is off by fifty
    times the noise over a millisecond's difference, and a handful of those would
    otherwise outweigh all others.

    Attributes:
        model: predicts.
        huber_delta: residual, in standard deviations, beyond which the loss is linear;
            infinite for least squares, as in eq. 4.8.
        scaling: between parameters and the unit box.
        evaluations: parameter sets simulated so far.
        failures: those at which the simulation failed, each with the reason.
        differences: the objective whose differences serve as derivatives: this one,
            or that of a surrogate.
    """

    def __init__(
        self,
        model: LogModel,
        workers: Workers | None = None,
        huber_delta: float = np.inf,
        surrogate: LogModel | None = None,
    ) -> None:
        """Evaluates nothing yet.

        Args:
            model: predicts.
            workers: evaluate it; by default this process.
            huber_delta: residual, in standard deviations, beyond which the loss is
                linear.
            surrogate: a faster model with the same parameters, for derivatives.

        Raises:
            DisasmError: two parameters have the same name.
        """
        _refuse_ambiguous_names(model)
        self.model, self.huber_delta = model, huber_delta
        self.scaling = Scaling(model.parameters)
        self.evaluations = 0
        self.failures: list[tuple[Array, str]] = []
        self._workers = workers = workers or Workers()
        self.differences = self
        if surrogate is not None and surrogate is not model:
            self.differences = Objective(surrogate, workers, huber_delta)

    def __call__(self, thetas: Array) -> Array:
        """Returns the values (b,) of parameter sets (b, p)."""
        return np.array([self.value(r) for r in self.residuals(thetas)])

    def value(self, residual: Array) -> float:
        """Returns f of weighted residuals (rows, channels)."""
        return rms(pseudo_residual(residual, self.huber_delta))

    def residuals(self, thetas: Array) -> list[Array]:
        """Returns the weighted residuals (rows, channels) of each of (b, p) sets.

        The caller sums over rows, in their order, so that no value depends on how
        many workers shared the work.

        Raises:
            DisasmError: predictions do not have the shape of the measurements.
        """
        thetas = np.atleast_2d(thetas)
        _, first, which = np.unique(
            thetas[:, self.model.simulated],
            axis=0,
            return_index=True,
            return_inverse=True,
        )
        parts = self._workers.simulate(self.model, thetas[first], self.model.chunks())
        self.evaluations += len(thetas)
        return [
            self._weighted(theta, parts[i])
            for theta, i in zip(thetas, which.reshape(-1), strict=True)
        ]

    def predictions(self, theta: Array) -> Array:
        """Returns the predictions at (p,), SI, (rows, channels)."""
        return self.predicted(self.residuals(theta)[0])

    def predicted(self, residual: Array) -> Array:
        """Returns the prediction (rows, channels), SI, that a residual belongs to."""
        return self.model.measurements.predicted(residual)

    @property
    def start(self) -> Array:
        """The nominal values (p,) in the unit box, where a fit begins."""
        return self.scaling.to_unit(nominal_values(self.model.parameters))

    def _weighted(self, theta: Array, parts: Sequence[Array | str]) -> Array:
        measured = self.model.measurements
        simulated: list[Array] = []
        for part in parts:
            if isinstance(part, str):
                self.failures.append((theta, part))
                return np.full(measured.values.shape, FAILED_RESIDUAL)
            simulated.append(part)
        whole = slice(0, measured.rows)
        predicted = self.model.read(theta, whole, np.concatenate(simulated))
        if predicted.shape != measured.values.shape:
            raise DisasmError(
                f"{type(self.model).__name__}.predict: returns the shape "
                f"{predicted.shape} for all rows, the measurements have "
                f"{measured.values.shape}; return (rows, channels)"
            )
        residual = measured.weighted(predicted)
        return np.clip(residual, -FAILED_RESIDUAL, FAILED_RESIDUAL)


def _refuse_ambiguous_names(model: LogModel) -> None:
    names = [parameter.name for parameter in model.parameters]
    for name in names:
        if names.count(name) > 1:
            raise DisasmError(
                f"{type(model).__name__}: two parameters are named '{name}'; rename one"
            )


def pseudo_residual(residual: Array, huber_delta: float) -> Array:
    """Returns residuals whose squares are Huber's loss, with their signs."""
    size = np.abs(residual)
    if huber_delta == np.inf:
        return residual
    huberised = np.sqrt(np.maximum(2.0 * huber_delta * size - huber_delta**2, 0.0))
    return np.where(size <= huber_delta, residual, np.sign(residual) * huberised)


def huber_weights(residual: Array, huber_delta: float) -> Array:
    """Returns the weight of each residual in a least-squares step, 1 within delta."""
    return np.minimum(1.0, huber_delta / np.maximum(np.abs(residual), 1e-300))


def rms(residual: NDArray[np.float64]) -> float:
    """Returns the root mean square of all elements."""
    return float(np.sqrt(np.mean(np.square(residual))))
