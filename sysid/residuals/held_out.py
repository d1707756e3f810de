"""Errors before and after, on rows that were not fitted."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from sysid.confidence import QUANTILES
from sysid.fitting.candidates import extended
from sysid.fitting.fit import Fit
from sysid.identification.uncertainty import block_length, block_numbers
from sysid.models.base import LogModel
from sysid.models.measurements import Channel

Array = NDArray[np.float64]

_MOST = 1000  # blocks of a bootstrap
_DRAWS = 2000  # of a bootstrap: ends of a 95 % interval rest on 50 each
_FOLDS = 10  # contiguous tenths, the usual number
_UNDETERMINED = 1e-6  # of the largest singular value: stays where it is


@dataclass(frozen=True)
class HeldOut:
    """Measured and predicted rows that no fit had seen.

    Attributes:
        measured, before, after: (rows, channels), SI.
        episode: (rows,) number of each row's episode.
        channels: what the columns are.
        how: how the rows were held out, in words.
        draws: of the bootstrap.
        names: of the episodes.
        period: of the rows' sampling [s]; None if they are not equally spaced.
        model_error: of the model itself, see `Measurements`.
    """

    measured: Array
    before: Array
    after: Array
    episode: NDArray[np.int64]
    channels: tuple[Channel, ...]
    how: str
    draws: int
    names: tuple[str, ...] = ()
    period: float | None = None
    model_error: Array | None = None

    @property
    def has_meaningful_share(self) -> bool:
        """Whether an error as a share of the readings means something.

        Not of readings near zero, nor of forces and torques together.
        """
        one_unit = len({channel.unit for channel in self.channels}) == 1
        return one_unit and self.relative(self.before) <= 1.0

    def of_episodes(self, numbers: Sequence[int]) -> Self:
        """Returns the rows of some episodes."""
        mask = np.isin(self.episode, numbers)
        error = self.model_error
        return dataclasses.replace(
            self,
            measured=self.measured[mask],
            before=self.before[mask],
            after=self.after[mask],
            episode=self.episode[mask],
            model_error=None if error is None else error[mask],
        )

    def rms(self, predicted: Array) -> Array:
        """Returns the rms error (channels,) of a prediction, SI."""
        return np.asarray(np.sqrt(np.mean((predicted - self.measured) ** 2, axis=0)))

    def rms_by_unit(self, predicted: Array) -> dict[str, float]:
        """Returns the rms error over all channels of each unit, SI."""
        squares = self.rms(predicted) ** 2
        return {
            unit: float(
                np.sqrt(squares[[c.unit == unit for c in self.channels]].mean())
            )
            for unit in dict.fromkeys(c.unit for c in self.channels)
        }

    def relative(self, predicted: Array) -> float:
        """Returns the norm of the error over the norm of what was measured."""
        error = np.linalg.norm(predicted - self.measured)
        return float(error / np.linalg.norm(self.measured))

    def in_noise(self, predicted: Array) -> float:
        """Returns the rms error in units of the noise and of the model's own error."""
        return float(np.sqrt(np.mean(self.in_sigma(predicted) ** 2)))

    def in_sigma(self, predicted: Array) -> Array:
        """Returns the rms error (channels,) in units of `sigma`."""
        error = (predicted - self.measured) / self.sigma
        return np.asarray(np.sqrt(np.mean(error**2, axis=0)))

    @property
    def sigma(self) -> Array:
        """See `Measurements`."""
        noise = np.array([channel.noise for channel in self.channels])
        return noise if self.model_error is None else np.hypot(noise, self.model_error)

    @property
    def model_error_rms(self) -> Array | None:
        """Rms (channels,) of what the model states of its own error; None: nothing."""
        if self.model_error is None:
            return None
        return np.asarray(np.sqrt(np.mean(self.model_error**2, axis=0)))

    def interval(
        self, predicted: Array, unit: Array | float = 1.0, seed: int = 0
    ) -> Array:
        """Returns 95 % intervals of the rms, by a block bootstrap.

        Args:
            predicted: (rows, channels), SI.
            unit: of the errors, such as `sigma`; 1: SI.
            seed: of the bootstrap.

        Returns:
            (channels, 2).
        """
        error = (predicted - self.measured) / unit
        length = block_length(error, self.episode)
        # Blocks may be longer than need be; more than a thousand cost only time.
        length = max(length, len(error) // _MOST)
        blocks = block_numbers(self.episode, length)
        count = int(blocks.max()) + 1
        squares = np.zeros((count, error.shape[1]))
        np.add.at(squares, blocks, error**2)
        rows = np.bincount(blocks, minlength=count)
        size = (self.draws, count)
        draws = np.random.default_rng(seed).integers(0, count, size)
        drawn = squares[draws].sum(axis=1) / rows[draws].sum(axis=1)[:, None]
        return np.sqrt(np.quantile(drawn, QUANTILES, axis=0)).T


def held_out_errors(first: Fit, last: Fit, test: LogModel | None) -> HeldOut:
    """Returns the errors of the base model and of the one with effects.

    Args:
        first, last: the fits without and with the effects.
        test: model of the held-out episodes; None if there are none: then contiguous
            blocks are predicted by fits to all others.
    """
    if test is not None:
        measured = test.measurements
        before, after = (_predicted(test, fit) for fit in (first, last))
        count = len(measured.names)
        how = f"{count} episode{'s' * (count > 1)} that "
        how += "were not fitted" if count > 1 else "was not fitted"
    else:
        measured = last.model.measurements
        folds = contiguous_folds(measured.episode, _FOLDS)
        before, after = (_linearly_predicted(fit, folds) for fit in (first, last))
        how = f"{folds.max() + 1} contiguous blocks, each predicted by a fit to the "
        how += "others"
    return HeldOut(
        measured.values,
        before,
        after,
        measured.episode,
        measured.channels,
        how,
        _DRAWS,
        measured.names,
        measured.period,
        measured.model_error,
    )


def contiguous_folds(episode: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """Returns the number of the fold (rows,) of each row, for about `count` folds."""
    length = max(1, -(-len(episode) // count))
    return block_numbers(episode, length)


def _predicted(test: LogModel, fit: Fit) -> Array:
    model, _ = extended(test, fit.effects, with_shapes=True)
    return model.with_begins(fit.theta).predictions(fit.theta)


def _linearly_predicted(fit: Fit, folds: NDArray[np.int64]) -> Array:
    return fit.model.measurements.predicted(_linear_residual(fit, folds))


def _linear_residual(fit: Fit, folds: NDArray[np.int64]) -> Array:
    """Returns residuals (rows, channels) of each fold by a fit to the others.

    Parameters that a bound holds stay there: past it the model does not go.
    """
    linearisation, free = fit.linearisation, ~fit.is_at_bound
    residual, u = linearisation.residual.copy(), linearisation.u[free]
    root, jacobian = np.sqrt(linearisation.weights), linearisation.jacobian[..., free]
    both = np.concatenate([jacobian, residual[..., None]], axis=2)
    both *= root[..., None]
    rows = [folds == fold for fold in range(int(folds.max()) + 1)]
    # Least squares of all rows are those of each fold's triangular factor.
    parts = [np.linalg.qr(both[own].reshape(-1, both.shape[2]), "r") for own in rows]
    for fold, own in enumerate(rows):
        others = np.concatenate([*parts[:fold], *parts[fold + 1 :]])
        A, b = others[:, :-1], others[:, -1]
        step = -np.linalg.lstsq(A, b, rcond=_UNDETERMINED)[0]
        step = np.clip(u + step, 0.0, 1.0) - u
        residual[own] += jacobian[own] @ step
    return residual
