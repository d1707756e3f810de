"""Logs in which nothing is missing, with noise as hard as real residuals: false alarms.

A model's own prediction plus noise that is drawn takes the place of what was measured.
Whatever closing the loop names then is a false alarm.
"""

from collections.abc import Callable
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from sysid.effect_selection.prewhitening import ArFilter
from sysid.models.base import LogModel
from sysid.parameters import nominal_values

Array = NDArray[np.float64]
Model = TypeVar("Model", bound=LogModel)

_FORGETS = 1000  # rows, after which a process knows nothing of its beginning
_SIEVE_ORDER = 30

#: Draws noise (rows, channels) of about unit variance; given what is predicted.
Noise = Callable[[np.random.Generator, Array], Array]


def white(random: np.random.Generator, predicted: Array) -> Array:
    """Returns independent normal noise."""
    return random.standard_normal(predicted.shape)


def heavy_tailed(random: np.random.Generator, predicted: Array) -> Array:
    """Returns noise of Student's t with 3 degrees of freedom, of unit variance."""
    return random.standard_t(3, predicted.shape) / np.sqrt(3.0)


def in_proportion(random: np.random.Generator, predicted: Array) -> Array:
    """Returns normal noise in proportion to the size of what is predicted."""
    size = np.abs(predicted)
    rms = np.sqrt(np.mean(size**2, axis=0))
    return random.standard_normal(predicted.shape) * size / np.maximum(rms, 1e-300)


def autoregressive(rho: float) -> Noise:
    """Returns noise that is correlated from row to row by rho."""

    def _draw(random: np.random.Generator, predicted: Array) -> Array:
        rows = len(predicted) + _FORGETS
        noise = random.standard_normal((rows, predicted.shape[1]))
        for row in range(1, rows):
            noise[row] = rho * noise[row - 1] + np.sqrt(1.0 - rho**2) * noise[row]
        return noise[_FORGETS:]

    return _draw


def both(first: Noise, second: Noise) -> Noise:
    """Returns the sum of two noises, of equal power: slow errors, and a sensor's."""

    def _draw(random: np.random.Generator, predicted: Array) -> Array:
        parts = [noise(random, predicted) for noise in (first, second)]
        return np.asarray(sum(parts) / np.sqrt(2.0))

    return _draw


def sieve(residual: Array) -> Noise:
    """Returns noise like a residual (rows, channels): an autoregressive sieve.

    The residual's innovations are drawn with replacement, row by row, so that channels
    stay correlated, and go through the model that whitened it (Bühlmann 1997).
    """
    filters = [ArFilter.of([r], _SIEVE_ORDER) for r in residual.T]
    scale = np.sqrt([f.variances[-1] / f.variances[0] for f in filters])
    whitened = [f(r) for f, r in zip(filters, residual.T, strict=True)]
    innovations = np.column_stack(whitened) * scale
    begin = max(f.order for f in filters)
    power = np.sqrt(np.mean(residual**2, axis=0))

    def _draw(random: np.random.Generator, predicted: Array) -> Array:
        rows = len(predicted) + _FORGETS
        drawn = innovations[random.integers(begin, len(residual), rows)]
        noise = np.zeros_like(drawn)
        for column, own in enumerate(filters):
            past = own.predictors[-1][1:]
            for row in range(len(past), rows):
                known = noise[row - len(past) : row, column][::-1]
                noise[row, column] = drawn[row, column] - past @ known
        return noise[_FORGETS:] / np.maximum(power, 1e-300)

    return _draw


def null_log(
    model: Model, noise: Noise, seed: int, theta: Array | None = None
) -> Model:
    """Returns the model with its own prediction and noise as what was measured.

    Args:
        model: whose channels state the noise.
        noise: is drawn.
        seed: of the draws.
        theta: (p,) values of its parameters; the nominal ones if left out.
    """
    measured = model.measurements
    theta = nominal_values(model.parameters) if theta is None else theta
    predicted = model.predictions(theta)
    drawn = noise(np.random.default_rng(seed), predicted) * measured.noise
    return model.with_measurements(measured.with_values(predicted + drawn))
