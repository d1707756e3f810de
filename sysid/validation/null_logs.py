"""Logs in which nothing is missing, with noise as hard as real residuals: false alarms.

A model's own prediction plus noise that is drawn takes the place of what was measured.
Whatever closing the loop names then is a false alarm.
"""

from collections.abc import Callable
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_toeplitz
from scipy.signal import lfilter

from sysid.identification.whiteness import autocorrelation
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
    order = min(_SIEVE_ORDER, len(residual) // 2)
    filters = [_whitening_filter(r, order) for r in residual.T]
    pairs = zip(filters, residual.T, strict=True)
    innovations = np.column_stack([lfilter(a, [1.0], r)[order:] for a, r in pairs])
    power = np.sqrt(np.mean(residual**2, axis=0))

    def _draw(random: np.random.Generator, predicted: Array) -> Array:
        rows = len(predicted) + _FORGETS
        drawn = innovations[random.integers(0, len(innovations), rows)]
        pairs = zip(filters, drawn.T, strict=True)
        noise = np.column_stack([lfilter([1.0], a, e) for a, e in pairs])
        return np.asarray(noise[_FORGETS:] / np.maximum(power, 1e-300))

    return _draw


def _whitening_filter(residual: Array, order: int) -> Array:
    """Returns weights (order + 1,) of a row and its past that make a residual white.

    By the Yule-Walker equations, whose model is stable.
    """
    rho = np.append(1.0, autocorrelation(residual, order))
    return np.append(1.0, -solve_toeplitz(rho[:-1], rho[1:]))


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
