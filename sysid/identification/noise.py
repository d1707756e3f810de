"""The noise of channels that nobody stated: from the residual of a first fit."""

from collections.abc import Sequence

import numpy as np

from sysid.identification.gauss_newton import gauss_newton
from sysid.models.base import Array, LogModel
from sysid.objective import Objective
from sysid.parameters import nominal_values
from sysid.workers import Workers

_ROUNDS = 3
_LEAST = 1e-12  # of the channel's spread: a channel that is fitted exactly


def with_estimated_noise(model: LogModel, workers: Workers, huber: float) -> LogModel:
    """Returns the model with each unknown noise taken from a fit's residual.

    Feasible generalised least squares: channels are weighted by their spread at
    first, then by their own residual, a few times over. What the model lacks counts
    as noise here, so the objective ends near 1 by construction and says nothing
    about the model; look at the residual's whiteness instead.
    """
    measured = model.measurements
    unknown = np.isnan(measured.noise)
    if not unknown.any():
        return model
    groups = model.noise_groups
    spread = np.maximum(
        _pooled(measured.values - measured.values.mean(axis=0), groups), 1e-12
    )
    noise = np.where(unknown, spread, measured.noise)
    for _ in range(_ROUNDS):
        model = model.with_measurements(measured.with_noise(noise, "first fit"))
        objective = Objective(model, workers, huber)
        start = objective.scaling.to_unit(nominal_values(model.parameters))
        residual = gauss_newton(objective, start).residual * noise
        found = np.maximum(_pooled(residual, groups), _LEAST * spread)
        noise = np.where(unknown, found, noise)
    return model.with_measurements(measured.with_noise(noise, "first fit"))


def _pooled(residual: Array, groups: Sequence[str]) -> Array:
    """Returns the rms (channels,) over all channels of the same group."""
    square = np.mean(residual**2, axis=0)
    labels = np.array(groups)
    return np.sqrt([square[labels == label].mean() for label in groups])
