"""An episode near the reference's values: the sums that its statistics are made of."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.fitting.block_grams import solve
from sysid.identification.linearisation import Linearisation

Array = NDArray[np.float64]

_SHOWN = 1e-6  # of a residual of the noise's size: what a change over its range moves
#: Mean square residual of a channel, in units of the noise: less is rounding.
LEAST_POWER = 1e-24


@dataclass(frozen=True)
class EpisodeNumbers:
    """What an episode shows.

    Attributes:
        values: (K,) of the statistics; NaN of a change that it does not show.
        right: (k,) products of the changes' derivatives and the residual.
        grams: (q,) of each change's derivatives with each other, one after the other.
        loss: weighted square of the residual.
        rows: of the episode.
    """

    values: Array
    right: Array
    grams: Array
    loss: float
    rows: int


@dataclass(frozen=True)
class LinearEpisode:
    """An episode near the reference's values.

    Attributes:
        own: (rows, channels, p) derivatives by the model's parameters.
        linear: residual, and its derivatives by changes.
        weights: (channels,).
        slope: (K,) of each amplitude, SI, by the unit of its derivative.
        groups: numbers of each change's amplitudes.
    """

    own: Array
    linear: Linearisation
    weights: Array
    slope: Array
    groups: tuple[range, ...]

    def with_residual(self, residual: Array) -> "LinearEpisode":
        """Returns the same motion with another residual (rows, channels)."""
        linear = dataclasses.replace(self.linear, residual=residual)
        return dataclasses.replace(self, linear=linear)

    def numbers(self) -> EpisodeNumbers:
        """Returns what the episode shows."""
        nothing = np.append(np.zeros(self.own.shape[2]), 1.0)
        return Products.of(self).numbers(nothing)


@dataclass(frozen=True)
class Products:
    """Products of an episode's columns and residual.

    Attributes:
        left: (channels, p + 1, p + 1) of derivatives by the model's p parameters and
            of the residual, which is last, by channel.
        cross: (p + 1, K) of those and the derivatives by changes, weighted.
        power: (K,) of these by themselves.
        grams: see EpisodeNumbers.
        weights: (channels,).
        slope: (K,) of each amplitude, SI, by the unit of its derivative.
        rows: of the episode.
    """

    left: Array
    cross: Array
    power: Array
    grams: Array
    weights: Array
    slope: Array
    rows: int

    @classmethod
    def of(cls, episode: LinearEpisode) -> "Products":
        """Returns the products of an episode."""
        linear, weights, rows = episode.linear, episode.weights, len(episode.own)
        left = np.concatenate([episode.own, linear.residual[..., None]], axis=2)
        root = np.sqrt(linear.weights)[..., None]
        left, columns = root * left, root * linear.jacobian
        whole = np.sqrt(weights)[:, None]
        flat = (whole * columns).reshape(-1, columns.shape[2])
        right = (whole * left).reshape(-1, left.shape[2])
        power = np.sum(flat**2, axis=0)
        parts = (flat[:, group.start : group.stop] for group in episode.groups)
        grams = np.concatenate([(part.T @ part).reshape(-1) for part in parts])
        by_channel = np.einsum("rci,rcj->cij", left, left, optimize=True)
        cross = right.T @ flat
        return cls(by_channel, cross, power, grams, weights, episode.slope, rows)

    def numbers(self, change: Array) -> EpisodeNumbers:
        """Returns what the episode shows.

        Args:
            change: (p + 1,) of the model's parameters, and 1 for the residual.
        """
        shows = self.power > _SHOWN**2 * self.rows
        right = change @ self.cross
        power = np.where(shows, self.power, np.inf)
        amplitudes = np.where(shows, -right / power * self.slope, np.nan)
        losses = np.einsum("i,cij,j->c", change, self.left, change) / self.rows
        values = np.concatenate([amplitudes, 0.5 * np.log(losses + LEAST_POWER)])
        loss = float(self.weights @ losses) * self.rows
        return EpisodeNumbers(values, right, self.grams, loss, self.rows)


def left_out(
    parts: Sequence[Products], is_fitted: Sequence[bool]
) -> list[Array | None]:
    """Returns how the model's parameters change if each episode is not fitted.

    (p + 1,), the last is 1. None of an episode that alone was fitted.
    """
    size = parts[0].left.shape[1] - 1
    nothing = np.append(np.zeros(size), 1.0)
    if not size:
        return [nothing for _ in parts]
    fitted = [i for i, own in enumerate(is_fitted) if own]
    grams = {i: np.tensordot(parts[i].weights, parts[i].left, 1) for i in fitted}
    total = np.sum(list(grams.values()), axis=0)

    def _step(gram: Array) -> Array:
        return -solve(gram[:-1, :-1], gram[:-1, -1])

    changes: list[Array | None] = [nothing for _ in parts]
    for i in fitted:
        own = _step(total - grams[i]) - _step(total) if len(fitted) > 1 else None
        changes[i] = None if own is None else np.append(own, 1.0)
    return changes
