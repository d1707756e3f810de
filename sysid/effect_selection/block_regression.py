"""Residuals, and what would explain them, block by block.

Near a fit, residuals are linear in the parameters, those of candidate effects
included: r(phi) = r + A phi. All that is asked of a candidate (does it show, what does
it explain of data that it was not fitted to) follows from the normal equations of each
block of rows, so that hundreds of candidates need no simulation beyond A.
"""

import dataclasses
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.stats import rankdata, wilcoxon

from sysid.identification.linearisation import Linearisation
from sysid.identification.uncertainty import block_length, block_numbers
from sysid.objective import huber_weights, pseudo_residual

Array = NDArray[np.float64]
Columns = NDArray[np.int64]

_RIDGE = 1e-10  # of the diagonal, against columns that depend on each other
_DRAWS = 4000
_LEAST_BLOCKS = 8
_NEW = 1e-3  # share of a column that the base can't do
_MOST_BLOCKS = 40
_SAME = 1e-6  # of a block's gain, that is no difference
_AT_BOUND = 1e-9  # of a parameter's range
_REWEIGHTED = 3  # times, where squares end
_FAR = 10.0  # times where squares end: a row that is missed by more has no say
_MOST_ROWS = 0.95  # of the rows, whose leverage none may exceed


@dataclass(frozen=True)
class BlockRegression:
    """Residuals and P columns that may explain them, by blocks of rows.

    Only the normal equations of what is asked for are ever made: of hundreds of
    columns, a candidate has a few.

    Attributes:
        A: (n, P) columns, each of rms 1; block by block.
        r: (n,) residuals, in units of the noise.
        begins: (B,) where each block begins.
        scale: (P,) what columns were divided by.
        side: (P,) 1 or -1 where a parameter can go up or down only, else 0.
        channels: of each row.
        huber: where squares end.
    """

    A: Array
    r: Array
    begins: NDArray[np.int64]
    scale: Array
    side: Array
    channels: int
    huber_delta: float

    @classmethod
    def of(
        cls,
        linearisation: Linearisation,
        blocks: NDArray[np.int64],
        extra: Array | None = None,
    ) -> Self:
        """Returns the study of a linearisation.

        Args:
            here: at the fit, with the candidates at null.
            blocks: (rows,) number of each row's block.
            extra: (rows, channels, k) further columns, of empirical dependences.
        """
        if extra is None:
            extra = np.zeros((*linearisation.residual.shape, 0))
        order = np.argsort(blocks, kind="stable")
        A = np.concatenate([linearisation.jacobian, extra], axis=2)[order]
        scale = np.maximum(np.sqrt(np.mean(A**2, axis=(0, 1))), 1e-300)
        A /= scale
        rows, channels, count = A.shape
        side = (linearisation.u < _AT_BOUND).astype(float) - (
            linearisation.u > 1.0 - _AT_BOUND
        )
        return cls(
            A.reshape(rows * channels, count),
            linearisation.residual[order].reshape(-1),
            np.unique(blocks[order], return_index=True)[1] * channels,
            scale,
            np.append(side, np.zeros(extra.shape[2])),
            channels,
            linearisation.huber_delta,
        )

    @property
    def energy(self) -> Array:
        """Loss of each block (B,): squares, and less beyond `huber`."""
        return self._loss(self.r)

    def moved(self, change: Array) -> "BlockRegression":
        """Returns the study of residuals elsewhere, a change (P,) of u away."""
        return dataclasses.replace(self, r=self.r + self.A @ (change * self.scale))

    def apart(self, mine: NDArray[np.bool_], size: int) -> "BlockRegression":
        """Returns the study with parameters once more, acting in some blocks alone.

        Args:
            mine: (B,) which blocks.
            size: number of the parameters, the first ones.
        """
        lengths = np.diff(self.begins, append=len(self.r))
        acts = np.repeat(mine, lengths)[:, None]
        return dataclasses.replace(
            self,
            A=np.hstack([self.A, self.A[:, :size] * acts]),
            scale=np.concatenate([self.scale, self.scale[:size]]),
            side=np.zeros(len(self.scale) + size),
        )

    def project_out(self, base: Columns) -> "BlockRegression":
        """Returns the study of all columns with some projected out, fitted to all rows.

        What a candidate adds is then judged apart from how well the base carries over:
        a base of many parameters that a block fixes alone would drown it. Columns
        that the base can do are zero.
        """
        if not len(base):
            return self
        own = self.A[:, base]
        weighted = self._weights(self.r)[:, None] * own
        H = (own.T @ weighted)[None]
        K = _solve(H, (weighted.T @ self.A)[None])[0]
        phi = -_solve(H, (weighted.T @ self.r)[None])[0]
        projected = self.A - own @ K
        left, size = (np.einsum("np,np->p", A, A) for A in (projected, self.A))
        projected *= left > _NEW**2 * size
        return dataclasses.replace(self, A=projected, r=self.r + own @ phi)

    def losses(self, columns: Columns) -> Array:
        """Returns what each block costs, (B,), if columns are fitted to all others.

        Contact makes and breaks: at a few rows a derivative is of no use, and huge. So
        a fit begins with and without the rows of the most extreme columns, rows that it
        misses by far lose their say, and the better of the two counts.
        """
        a = self.A[:, self._possible(columns)]
        starts = [np.ones(len(self.r))]
        if np.isfinite(self.huber_delta) and a.shape[1]:
            starts.append(self._calm(a))
        found = [self._left_out(a, w) for w in starts]
        return min(found, key=np.sum)

    def _left_out(self, a: Array, calm: Array) -> Array:
        """Returns what each block costs, (B,), if columns (n, k) fit all others.

        Args:
            a: columns.
            calm: (n,) weights to begin with.
        """
        w = calm * self._weights(self.r)
        for _ in range(_REWEIGHTED if np.isfinite(self.huber_delta) else 0):
            phi = -_solve((a.T @ (w[:, None] * a))[None], (a.T @ (w * self.r))[None])
            w = calm * self._weights(self.r + a @ phi[0])
        H, g = self._parts(a, w)
        others = -_solve(H.sum(axis=0) - H, g.sum(axis=0) - g)
        lengths = np.diff(self.begins, append=len(self.r))
        change = np.einsum("nk,nk->n", a, np.repeat(others, lengths, axis=0))
        return self._loss(self.r + change)

    def _calm(self, a: Array) -> Array:
        """Returns weights (n,) that give no row more leverage than most have."""
        size = np.abs(a).max(axis=1).reshape(-1, self.channels).max(axis=1)
        most = np.quantile(size, _MOST_ROWS)
        weight = np.minimum(1.0, most / np.maximum(size, 1e-300)) ** 2
        return np.repeat(weight, self.channels)

    def _weights(self, r: Array) -> Array:
        """Returns the weights (n,) of residuals: Huber's, and less far beyond."""
        if not np.isfinite(self.huber_delta):
            return np.ones(len(r))
        far = np.minimum(1.0, _FAR * self.huber_delta / np.maximum(np.abs(r), 1e-300))
        return huber_weights(r, self.huber_delta) * far**2

    def _loss(self, r: Array) -> Array:
        """Returns the loss of each block (B,) of residuals (n,)."""
        squares = pseudo_residual(r, self.huber_delta) ** 2
        return np.asarray(np.add.reduceat(squares, self.begins))

    def spread(self) -> Array:
        """Returns the standard deviation (P,) of all parameters, fitted together."""
        parts_H, parts_g = self._parts(self.A, self._weights(self.r))
        H = parts_H.sum(axis=0)
        size = np.sqrt(np.diagonal(H))
        size = np.where(size > 0.0, size, 1.0)
        H = H / np.outer(size, size)
        gradient = np.linalg.pinv(H, hermitian=True) @ (parts_g / size).T
        return np.asarray(np.linalg.norm(gradient, axis=1) / size / self.scale)

    def _parts(self, a: Array, w: Array) -> tuple[Array, Array]:
        """Returns the normal equations of columns (n, k), (B, k, k) and (B, k)."""
        weighted = w[:, None] * a
        ends = [*self.begins[1:], len(self.r)]
        blocks = [slice(i, j) for i, j in zip(self.begins, ends, strict=True)]
        H = np.array([a[block].T @ weighted[block] for block in blocks])
        return H, np.array([weighted[block].T @ self.r[block] for block in blocks])

    def _possible(self, columns: Columns) -> Columns:
        """Returns the columns without those that a bound keeps from helping."""
        if not self.side[columns].any():
            return columns
        w = self._weights(self.r)
        while len(columns):
            a = self.A[:, columns]
            weighted = w[:, None] * a
            phi = -_solve((a.T @ weighted)[None], (weighted.T @ self.r)[None])[0]
            barred = phi * self.side[columns] < 0.0
            if not barred.any():
                break
            columns = columns[~barred]
        return columns


def family_p(gains: Array, seed: int = 0) -> Array:
    """Returns for each candidate the family-wise p-value that it explains nothing.

    Wilcoxon's signed ranks of what blocks gain by it when they are predicted from all
    others, and the highest over all candidates with the blocks' signs flipped
    together: whatever correlation there is within a block or between candidates, and
    whatever single block dominates. The price of a candidate's parameters is in its
    gains.

    Args:
        gains: (B, k), of each block by each candidate.
        seed: of the signs.
    """
    ranks = np.sign(gains) * rankdata(np.abs(gains), axis=0)
    unit = ranks / np.maximum(np.linalg.norm(ranks, axis=0), 1e-300)
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], (_DRAWS, len(gains)))
    highest = (signs @ unit).max(axis=1, initial=0.0)
    above = (highest[:, None] >= unit.sum(axis=0) - 1e-12).sum(axis=0)
    p: Array = (1.0 + above) / (1.0 + _DRAWS)
    return p


def blocks_of(
    linearisation: Linearisation, episode: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Returns the block (rows,) of each row: longer than residuals stay correlated."""
    rows = len(episode)
    length = block_length(linearisation.residual, episode)
    length = max(length, rows // _MOST_BLOCKS)
    return block_numbers(episode, int(min(length, max(1, rows // _LEAST_BLOCKS))))


def worse_p(gains: Array, best: Array) -> float:
    """Returns the p-value that gains (B,) are no less than the best's, block by block.

    Wilcoxon's signed ranks of the differences: two candidates that explain the same
    blocks by as much can't be told apart, whatever their totals.
    """
    difference = best - gains
    if not np.abs(difference).max(initial=0.0) > _SAME * np.abs(best).max(initial=0.0):
        return 1.0
    return float(wilcoxon(difference, alternative="greater").pvalue)


def _solve(H: Array, g: Array) -> Array:
    """Returns H^-1 g of a batch, a little ridge against dependent columns."""
    size = H.shape[-1]
    diagonal = np.diagonal(H, axis1=1, axis2=2)
    ridge = _RIDGE * diagonal + 1e-300
    regular = H + ridge[:, :, None] * np.eye(size)
    if g.ndim == 2:
        return np.asarray(np.linalg.solve(regular, g[..., None])[..., 0])
    return np.asarray(np.linalg.solve(regular, g))
