"""Gram matrices by blocks of rows: all that the selection of effects needs of a log.

Near a fit, residuals are linear in the parameters, those of candidate effects
included: r(phi) = r + A phi. The products [A r]^T [A r] of each block of rows, one for
each channel, are sufficient statistics: fits, losses of blocks that were not fitted,
intervals and tests follow from them. They add up over logs and over machines, and the
rows are not needed any more.
"""

import dataclasses
import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from sysid.identification.uncertainty import block_numbers

Array = NDArray[np.float64]
Columns = NDArray[np.int64]

# Numerical guards, not thresholds.
_RIDGE = 1e-9  # of the diagonal, against columns that depend on each other
_AT_NULL = 1e-6  # of a parameter's range: bounds nearer than that are zero
_SPANNED = 1e-4  # of a column's power: less than that is new beside others


@dataclass(frozen=True)
class BlockGrams:
    """Gram matrices of P columns and a residual, by blocks of rows and by channel.

    Attributes:
        grams: (B, C, P + 1, P + 1), the residual last.
        rows: (B,) of each block.
        episode: (B,) number of the episode that each block is of.
        bounds: (P, 2) of each column's coefficient.
    """

    grams: Array
    rows: NDArray[np.int64]
    episode: NDArray[np.int64]
    bounds: Array

    @classmethod
    def of(
        cls,
        columns: Sequence[Array],
        residual: Array,
        weights: Array,
        blocks: NDArray[np.int64],
        episode: NDArray[np.int64],
        bounds: Array,
        pooled: bool = False,
    ) -> "BlockGrams":
        """Returns the Gram matrices of some rows.

        Args:
            columns: (rows, channels, k) each; all of them are the P columns.
            residual: (rows, channels).
            weights: (rows, channels) of rows in the loss.
            blocks: (rows,) number of each row's block, from 0, in order.
            episode: (rows,) number of each row's episode.
            bounds: (P, 2) see the class.
            pooled: whether channels are added up, since their weights are known.
        """
        root = np.sqrt(weights)
        starts = np.flatnonzero(np.diff(blocks, prepend=-1))
        ends = [*starts[1:], len(blocks)]
        size = sum(each.shape[2] for each in columns) + 1
        channels = 1 if pooled else residual.shape[1]
        grams = np.empty((len(starts), channels, size, size))
        for b, (i, j) in enumerate(zip(starts, ends, strict=True)):
            own = np.concatenate(
                [*(each[i:j] for each in columns), residual[i:j, :, None]], axis=2
            )
            own *= root[i:j, :, None]
            own = own.reshape(-1, 1, size) if pooled else own
            for c in range(channels):
                grams[b, c] = own[:, c].T @ own[:, c]
        return cls(grams, np.diff([*starts, len(blocks)]), episode[starts], bounds)

    def __add__(self, other: "BlockGrams") -> "BlockGrams":
        """Returns the blocks of two logs of the same columns."""
        episode = other.episode + 1 + self.episode.max(initial=-1)
        return BlockGrams(
            np.concatenate([self.grams, other.grams]),
            np.concatenate([self.rows, other.rows]),
            np.concatenate([self.episode, episode]),
            self.bounds,
        )

    def shifted(self, change: Array) -> "BlockGrams":
        """Returns the same of the residual that a change (P,) of coefficients leads to.

        The residual becomes r + A c, with which its row and its column change.
        """
        c = np.append(change, 0.0)
        grams, along = self.grams.copy(), self.grams @ c
        grams[..., -1, :] += along
        grams[..., :, -1] += along
        grams[..., -1, -1] += along @ c
        return dataclasses.replace(self, grams=grams)

    def select(self, mask: NDArray[np.bool_]) -> "BlockGrams":
        """Returns some of the blocks."""
        return dataclasses.replace(
            self,
            grams=self.grams[mask],
            rows=self.rows[mask],
            episode=self.episode[mask],
        )

    def of_columns(self, columns: Columns) -> "BlockGrams":
        """Returns the same of some columns."""
        kept = np.append(columns, -1)
        grams = self.grams[:, :, kept][:, :, :, kept]
        return dataclasses.replace(self, grams=grams, bounds=self.bounds[columns])

    def channel_powers(self, columns: Columns) -> Array:
        """Returns the mean square (channels,) that columns leave of each channel."""
        small = self.of_columns(columns)
        equations = small.weighted(np.ones(self.grams.shape[1]))
        x = np.append(equations.solution(np.arange(len(columns))), 1.0)
        losses = ((small.grams @ x) @ x).sum(axis=0)
        return np.asarray(losses / self.rows.sum())

    def weighted(self, weights: Array) -> "NormalEquations":
        """Returns the normal equations with a weight (channels,) for each channel."""
        blocks = sum(w * self.grams[:, c] for c, w in enumerate(weights))
        power = np.einsum("bii->i", blocks)
        size = len(power) - 1
        return NormalEquations(
            blocks, self.rows, self.episode, self.bounds, power[:size]
        )


@dataclass(frozen=True)
class NormalEquations:
    """Normal equations of columns and a residual by blocks, some projected out.

    Attributes:
        blocks: (B, P + 1, P + 1), the residual last; zero where columns were projected
            out.
        rows, episode, bounds: see BlockGrams.
        power: (P,) of each column before any was projected out.
    """

    blocks: Array
    rows: NDArray[np.int64]
    episode: NDArray[np.int64]
    bounds: Array
    power: Array

    @functools.cached_property
    def total(self) -> Array:
        """The sum (P + 1, P + 1) over all blocks."""
        return np.asarray(self.blocks.sum(axis=0))

    @property
    def losses(self) -> Array:
        """The loss of each block (B,)."""
        return self.blocks[:, -1, -1]

    def select(self, mask: NDArray[np.bool_]) -> "NormalEquations":
        """Returns some of the blocks."""
        return dataclasses.replace(
            self,
            blocks=self.blocks[mask],
            rows=self.rows[mask],
            episode=self.episode[mask],
        )

    def merged(self, groups: NDArray[np.int64]) -> "NormalEquations":
        """Returns the same with blocks added up by their group (B,)."""
        known, first = np.unique(groups, return_index=True)
        if len(known) == len(groups):
            return self
        return dataclasses.replace(
            self,
            blocks=np.array([self.blocks[groups == g].sum(axis=0) for g in known]),
            rows=np.array([self.rows[groups == g].sum() for g in known]),
            episode=self.episode[first],
        )

    def of_columns(self, columns: Columns) -> "NormalEquations":
        """Returns the same of some columns."""
        kept = np.append(columns, -1)
        return dataclasses.replace(
            self,
            blocks=self.blocks[:, kept][:, :, kept],
            bounds=self.bounds[columns],
            power=self.power[columns],
        )

    def is_new(self, columns: Columns) -> NDArray[np.bool_]:
        """Returns which columns (k,) those that were projected out do not span."""
        left = np.diagonal(self.total)[columns]
        return np.asarray(left > _SPANNED * self.power[columns])

    def projected(self, columns: Columns) -> "NormalEquations":
        """Returns the same with columns projected out, fitted to all blocks.

        What a candidate adds is then judged apart from how well the base generalises:
        a base of many parameters, each fixed by a single block, would hide it.
        """
        columns = columns[self.is_new(columns)]
        if not len(columns):
            return self
        total = self.total
        K = solve(total[np.ix_(columns, columns)], total[columns])
        across = self.blocks[:, columns]
        within = across[:, :, columns]
        cross = K.T @ (across - 0.5 * within @ K)
        blocks = self.blocks - cross
        blocks -= np.swapaxes(cross, 1, 2)
        blocks[:, columns] = 0.0
        blocks[:, :, columns] = 0.0
        return dataclasses.replace(self, blocks=blocks)

    def solution(self, columns: Columns) -> Array:
        """Returns the least-squares coefficients (k,) of columns."""
        total = self.total
        return -solve(total[np.ix_(columns, columns)], total[columns, -1])

    def feasible(self, columns: Columns) -> Columns:
        """Returns the columns that are new, and whose coefficients are in bounds."""
        kept = columns[self.is_new(columns)]
        while len(kept):
            x, (low, high) = self.solution(kept), self.bounds[kept].T
            wrong = (x < low) | (x > high)
            if not wrong.any():
                break
            kept = kept[~wrong]
        return kept

    def bounded_at_null(self) -> Self:
        """Returns the same, of coefficients that have no bound but zero."""
        none = np.where(np.abs(self.bounds) > _AT_NULL, np.inf, np.abs(self.bounds))
        return dataclasses.replace(self, bounds=none * [-1.0, 1.0])

    def held_out(self, columns: Columns) -> Array:
        """Returns the loss of each block (B,) with columns fitted to all others."""
        if not len(columns):
            return self.losses
        kept = np.append(columns, -1)
        own = self.blocks[:, kept][:, :, kept]
        x = self._of_others(own)
        return np.asarray(np.einsum("bi,bij,bj->b", x, own, x))

    def fitted_to_others(self, columns: Columns) -> Array:
        """Returns the coefficients (B, k) of columns, fitted to all other blocks."""
        kept = np.append(columns, -1)
        return self._of_others(self.blocks[:, kept][:, :, kept])[:, :-1]

    def held_out_gain(self, columns: Columns) -> float:
        """Returns the share of the loss that columns take away, see `held_out`."""
        total = max(float(self.losses.sum()), 1e-300)
        return float(1.0 - self.held_out(columns).sum() / total)

    def held_out_each(self) -> Array:
        """Returns the same (B, P) of each column by itself."""
        size = self.blocks.shape[1] - 1
        diagonal = np.einsum("bii->bi", self.blocks)[:, :size]
        right = self.blocks[:, :size, -1]
        total = np.diagonal(self.total)[:size]
        is_there = self.is_new(np.arange(size))
        others = np.where(is_there, total - diagonal + _RIDGE * total, np.inf)
        x = (right - self.total[:size, -1]) / np.maximum(others, 1e-300)
        return np.asarray(self.losses[:, None] + 2.0 * x * right + x**2 * diagonal)

    def folds(self, count: int) -> "NormalEquations":
        """Returns the same with blocks added up to so many contiguous folds."""
        return self.merged(fold_numbers(len(self.rows), count))

    def covariance(self, columns: Columns) -> Array:
        """Returns the covariance (k, k) of all columns' coefficients, fitted together.

        The jackknife: each block is left out in turn, and all coefficients are fitted
        to the others (Efron and Stein 1981). Right for residuals that are correlated,
        as long as a block is longer than that lasts, and for coefficients that take up
        noise; Student's t has `degrees_of_freedom`.
        """
        x = self.fitted_to_others(columns)
        away = x - x.mean(axis=0)
        return np.asarray((1.0 - 1.0 / len(x)) * away.T @ away)

    def errors_beside(self, base: Columns) -> Array:
        """Returns the standard error (P,) of each column, fitted with a base alone.

        See `covariance`; of a column that others do not span.
        """
        base = base[self.is_new(base)]
        others = self.total - self.blocks
        along, right = others[:, base], others[:, base][:, :, base]
        K = solve(right, along) if len(base) else along
        left = others - np.swapaxes(K, 1, 2) @ along
        power = np.maximum(np.einsum("bii->bi", left)[:, :-1], 1e-300)
        x = -left[:, :-1, -1] / power
        with np.errstate(over="ignore"):  # unbounded, of a column in one block alone
            return np.sqrt((len(x) - 1.0) * x.var(axis=0))

    @staticmethod
    def _of_others(own: Array) -> Array:
        """Returns coefficients (B, k + 1), the last 1, fitted to all other blocks."""
        others = own.sum(axis=0) - own
        x = np.ones(own.shape[:2])
        x[:, :-1] = -solve(others[:, :-1, :-1], others[:, :-1, -1])
        return x

    @property
    def degrees_of_freedom(self) -> int:
        """Of a covariance: one less than there are blocks."""
        return max(1, len(self.rows) - 1)


def blocks_of(episode: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """Returns the number of the block (rows,) of each row: contiguous, of equal size.

    About so many. A block spans two episodes only where there are more of those.
    """
    rows, episodes = len(episode), int(episode.max()) + 1
    if 2 * episodes > count:
        return np.asarray(episode * min(count, episodes) // episodes)
    return block_numbers(episode, -(-rows // (count - episodes + 1)))


def fold_numbers(blocks: int, count: int) -> NDArray[np.int64]:
    """Returns the fold (blocks,) of each block: contiguous runs of blocks."""
    return np.asarray(np.arange(blocks) * min(count, blocks) // blocks)


def solve(A: Array, b: Array) -> Array:
    """Returns A^-1 b of symmetric matrices (..., k, k) and (..., k) or (..., k, n).

    Scaled, and with a ridge that keeps columns apart that depend on each other.
    """
    scale = np.sqrt(np.maximum(np.einsum("...ii->...i", A), 1e-300))
    scaled = A / (scale[..., :, None] * scale[..., None, :])
    scaled = scaled + _RIDGE * np.eye(A.shape[-1])
    is_vector = b.ndim == A.ndim - 1
    right = b[..., None] if is_vector else b
    found = np.linalg.solve(scaled, right / scale[..., None]) / scale[..., None]
    return np.asarray(found[..., 0] if is_vector else found)
