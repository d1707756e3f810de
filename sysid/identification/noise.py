"""Noise that is not stated, estimated from the residual of a first fit."""

from collections.abc import Sequence

import numpy as np

from sysid.identification.gauss_newton import gauss_newton
from sysid.models.base import Array, LogModel
from sysid.objective import Objective
from sysid.workers import Workers

_LEAST = 1e-12  # of the channel's spread: a channel that is fitted exactly


def with_estimated_noise(
    model: LogModel, workers: Workers, huber_delta: float
) -> LogModel:
    """Returns the model with each unknown noise taken from a fit's residual.

    Weighted least squares as usual for arms: all channels of one unit have the same
    weight in a first fit, and then each that of its own residual there. (Iterated, the
    channel that happens to fit best would outweigh the others.) What the model lacks
    counts as noise here, so the objective ends near 1 by construction and is no
    measure of the model; look at the residual's whiteness instead.
    """
    measured = model.measurements
    unknown = np.isnan(measured.noise)
    if not unknown.any():
        return model
    units = [channel.unit for channel in measured.channels]
    centred = measured.values - measured.values.mean(axis=0)
    spread = np.maximum(_pooled(centred, units), 1e-12)
    noise = np.where(unknown, spread, measured.noise)
    first = model.with_measurements(measured.with_noise(noise, "spread"))
    objective = Objective(first, workers, huber_delta)
    residual = gauss_newton(objective, objective.start).residual * noise
    found = np.maximum(_pooled(residual, model.noise_groups), _LEAST * spread)
    estimated = np.where(unknown, found, measured.noise)
    return model.with_measurements(measured.with_noise(estimated, "first fit"))


def with_noise_of(base: LogModel, model: LogModel) -> LogModel:
    """Returns a model of the same channels with the noise of another.

    Args:
        base: whose noise is known, or was estimated.
        model: of other rows, or of the same ones written otherwise.
    """
    known, origin = base.measurements.noise, base.measurements.channels[0].origin
    return model.with_measurements(model.measurements.with_noise(known, origin))


def _pooled(residual: Array, groups: Sequence[str]) -> Array:
    """Returns the rms (channels,) over all channels of the same group."""
    square = np.mean(residual**2, axis=0)
    labels = np.array(groups)
    return np.sqrt([square[labels == label].mean() for label in groups])
