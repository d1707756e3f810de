"""Least squares by blocks of rows, for many targets and one set of columns."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Self, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

Array = NDArray[np.float64]
Way = TypeVar("Way")

MOST_BLOCKS = 8  # enough for a standard error, and each long against correlations
#: Rows per block at least: of fewer blocks less can be said.
LEAST_ROWS = 2
LEAST_GAIN = 0.01  # of the loss: as much as closing the loop asks of an effect
STANDARD_ERRORS = 3.0  # Student's t of eight blocks: one in a hundred by chance
#: Of the loss of the channels that a sign or an order concerns: a wrong one leaves at
#: least as much again. Effects that the model lacks change it by less.
FAR_BETTER = 0.5
BY_CHANCE = 0.01  # how often a way of writing may be taken that is none
_PARTS = 4  # contiguous ones of a log; all but one have to agree
_EQUAL = 0.9  # of the least loss: ways that leave less than it / this tie
_ROUNDED = 1e-9  # of a loss: less is rounding
_RANK = 1e-10  # of the largest eigenvalue of the columns' scaled products


def blocks_of(rows: int) -> NDArray[np.int64]:
    """Returns the number of the contiguous block of each row (rows,)."""
    count = max(1, min(MOST_BLOCKS, rows // LEAST_ROWS))
    return np.arange(rows) * count // max(rows, 1)


@dataclass(frozen=True)
class ChannelGrams:
    """Products of columns and targets, by contiguous blocks of rows and by channel.

    Each channel is fitted by columns whose coefficients all channels share, and by
    columns of its own; the last of these may not be negative: friction takes power.

    Attributes:
        G: (blocks, channels, m, m) of [shared, own, targets].
        count: (blocks,) of rows.
        shared, own: how many columns.
        positive: how many of a channel's own, the last ones, are not negative.
    """

    G: Array
    count: Array
    shared: int
    own: int
    positive: int

    @classmethod
    def of(
        cls,
        shared: Array,
        targets: Array,
        own: Array | None = None,
        positive: int = 0,
    ) -> Self:
        """Sums the products.

        Args:
            shared: (rows, channels, s).
            targets: (rows, channels, t), of which a choice is fitted.
            own: (rows, channels, o).
            positive: of the own ones.
        """
        own = np.zeros((*shared.shape[:2], 0)) if own is None else own
        all_columns = np.concatenate([shared, own, targets], axis=-1)
        block = blocks_of(len(shared))
        by_channel = np.swapaxes(all_columns, 0, 1)
        parts = [by_channel[:, block == k] for k in range(block[-1] + 1)]
        G = np.array([np.swapaxes(part, 1, 2) @ part for part in parts])
        count = np.bincount(block).astype(float)
        return cls(G, count, shared.shape[-1], own.shape[-1], positive)

    def losses(self, choice: Array, scale: Array) -> Array:
        """Returns held-out losses (blocks, channels), by a fit to all other blocks.

        Args:
            choice: (channels, t) what is fitted at each channel, of its targets.
            scale: (channels,) in units of which errors are.
        """
        fits = self._fits(choice, scale)
        left = [
            self._left(G, fit, choice, scale)
            for G, fit in zip(self.G, fits, strict=True)
        ]
        return np.array(left) / self.count[:, None]

    def loss(self, choice: Array, scale: Array) -> Array:
        """Returns what a fit to all blocks leaves (channels,); see `losses`."""
        A, b = (part.sum(axis=0) for part in self._normal(choice, scale))
        G = self.G.sum(axis=0)
        left = self._left(G, self._solved(A, b), choice, scale)
        return left / float(self.count.sum())

    def shared_by_block(self, choice: Array, scale: Array) -> Array:
        """Returns the shared coefficients (blocks, s) without each block in turn.

        Args:
            choice, scale: see `losses`.
        """
        return np.array(self._fits(choice, scale))[:, : self.shared]

    def _fits(self, choice: Array, scale: Array) -> list[Array]:
        """Returns the coefficients (p,) without each block in turn."""
        A, b = self._normal(choice, scale)
        return [
            self._solved(A.sum(axis=0) - of_block, b.sum(axis=0) - by_block)
            for of_block, by_block in zip(A, b, strict=True)
        ]

    def _left(self, G: Array, x: Array, choice: Array, scale: Array) -> Array:
        """Returns the sum of squares (channels,) that coefficients (p,) leave.

        Args:
            G: (channels, m, m) products.
            x: coefficients.
            choice, scale: see `losses`.
        """
        channels = len(scale)
        shared = np.tile(x[: self.shared], (channels, 1))
        z = np.hstack([shared, x[self.shared :].reshape(channels, -1), -choice])
        left = np.einsum("cm,cmn,cn->c", z, G, z) / scale**2
        return np.asarray(np.maximum(left, 0.0))

    @property
    def _columns(self) -> int:
        return self.shared + self.own

    @cached_property
    def _norm(self) -> Array:
        """Root of the mean square of each coefficient's column."""
        square = np.diagonal(self.G.sum(axis=0), axis1=1, axis2=2)
        own = square[:, self.shared : self._columns].reshape(-1)
        norm = np.sqrt(np.concatenate([square[:, : self.shared].sum(axis=0), own]))
        return np.where(norm > 0.0, norm, 1.0)

    def _normal(self, choice: Array, scale: Array) -> tuple[Array, Array]:
        """Returns the normal equations' A (blocks, p, p) and b (blocks, p)."""
        s, m = self.shared, self._columns
        channels = self.G.shape[1]
        weighted = self.G / scale[None, :, None, None] ** 2
        size = s + channels * self.own
        A = np.zeros((len(self.G), size, size))
        b = np.zeros((len(self.G), size))
        A[:, :s, :s] = weighted[:, :, :s, :s].sum(axis=1)
        by_target = np.einsum("kcmt,ct->kcm", weighted[:, :, :m, m:], choice)
        b[:, :s] = by_target[:, :, :s].sum(axis=1)
        for i in range(channels):
            at = slice(s + i * self.own, s + (i + 1) * self.own)
            A[:, :s, at] = weighted[:, i, :s, s:m]
            A[:, at, :s] = weighted[:, i, s:m, :s]
            A[:, at, at] = weighted[:, i, s:m, s:m]
            b[:, at] = by_target[:, i, s:]
        return A, b

    @cached_property
    def _is_positive(self) -> NDArray[np.bool_]:
        channels = self.G.shape[1]
        last = np.arange(self.own) >= self.own - self.positive
        return np.concatenate([np.zeros(self.shared, bool), np.tile(last, channels)])

    def _solved(self, A: Array, b: Array) -> Array:
        """Returns the coefficients (p,), those of friction not negative.

        All others are eliminated first (Schur complement), which leaves a small problem
        of non-negative least squares (Lawson and Hanson 1974).
        """
        A, b = A / np.outer(self._norm, self._norm), b / self._norm
        free = ~self._is_positive
        held = self._is_positive & (np.diagonal(A) > 0.0)  # of no row: stays zero
        inverse = np.linalg.pinv(A[np.ix_(free, free)], _RANK, hermitian=True)
        x = np.zeros(len(b))
        if held.any():
            through = A[np.ix_(held, free)] @ inverse
            S = A[np.ix_(held, held)] - through @ A[np.ix_(free, held)]
            least = _RANK * float(np.trace(A[np.ix_(held, held)]))
            x[held] = _non_negative(S, b[held] - through @ b[free], least)
        x[free] = inverse @ (b[free] - A[np.ix_(free, held)] @ x[held])
        return np.asarray(x / self._norm)


def _non_negative(S: Array, r: Array, least: float) -> Array:
    """Returns x >= 0 with the least x S x / 2 - r x, of a positive semidefinite S.

    Directions whose eigenvalue is not above the least are rounding, and not taken.
    """
    values, vectors = np.linalg.eigh(S)
    kept = values > max(least, 1e-300)
    if not kept.any():
        return np.zeros(len(r))
    root = np.sqrt(values[kept])
    x = nnls(root[:, None] * vectors[:, kept].T, (vectors[:, kept].T @ r) / root)[0]
    return np.asarray(x)


@dataclass(frozen=True)
class Estimate:
    """A number with its standard error."""

    value: float
    error: float

    def is_off(self, expected: float, least: float = 0.0) -> bool:
        """Returns whether it differs from what is expected, beyond its error."""
        off = abs(self.value - expected)
        return bool(off > max(least, STANDARD_ERRORS * self.error))


def is_lower(losses: Array, than: Array) -> bool:
    """Returns whether losses by block (blocks,) are lower than others beyond chance.

    By their ratios, so that no single block decides.
    """
    floor = _ROUNDED * float(than.mean()) + 1e-300
    gain = np.log((than + floor) / (losses + floor))
    if len(gain) < 2 or float(gain.mean()) <= LEAST_GAIN:
        return False
    error = float(gain.std(ddof=1)) / np.sqrt(len(gain))
    return float(gain.mean()) > STANDARD_ERRORS * error


def runs_of(values: Array) -> Array:
    """Returns how often each channel (rows, channels) changes sides of its mean.

    Plus one. A log that swings twice says about as much as two numbers, however many
    rows it has.
    """
    above = values > values.mean(axis=0)
    return 1.0 + np.sum(above[1:] != above[:-1], axis=0)


def is_beyond_chance(losses: Array, than: Array, runs: Array, ways: float) -> bool:
    """Returns whether losses (channels,) are lower than the best of chances makes them.

    The ratio of likelihoods has to exceed how many ways are tried.

    Args:
        losses, than: of the better way and of the other.
        runs: (channels,) see `runs_of`.
        ways: logarithm of how many are tried.
    """
    gain = 0.5 * runs @ np.log((than + 1e-300) / (losses + 1e-300))
    return bool(gain > ways - np.log(BY_CHANCE))


def parts_of(blocks: Sequence[int]) -> list[NDArray[np.int64]]:
    """Returns the numbers of the blocks of each of four contiguous parts of a log."""
    return np.array_split(np.asarray(blocks), _PARTS)


def is_replicated(losses: Array, than: Array) -> bool:
    """Returns whether losses by block (blocks,) are lower in all but one of four parts.

    False of fewer blocks than parts.
    """
    parts = parts_of(range(len(losses)))
    lower = [bool((than - losses)[part].sum() > 0.0) for part in parts]
    return lower.count(True) >= _PARTS - 1


def jackknife_error(without: Sequence[float] | Array) -> float:
    """Returns the standard error of a value, from those without each block in turn.

    Args:
        without: (blocks,) or (blocks, k); of a vector, the norm of its error.
    """
    values = np.asarray(without, dtype=float)
    n = len(values)
    square = np.sum((values - values.mean(axis=0)) ** 2) * (n - 1) / n
    return float(np.sqrt(square))


def angle_between(a: Array, b: Array) -> float:
    """Returns the angle between two vectors (3,) [rad]."""
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))


def likely(ways: Sequence[tuple[Way, float]]) -> list[Way]:
    """Returns those of some ways of writing that leave about the least.

    Args:
        ways: each with what it leaves.
    """
    least = min((lost for _, lost in ways), default=0.0)
    return [way for way, lost in ways if lost * _EQUAL <= least]
