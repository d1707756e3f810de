"""Linear regression of residuals on candidate effects, by blocks of rows.

Near a fit, residuals are linear in the parameters, those of candidate effects
included: r(phi) = r + A phi. What a candidate explains of rows that it was not fitted
to follows from the normal equations of each block of rows, so that hundreds of
candidates need no simulation beyond A.
"""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from sysid.effect_selection.settings import SelectionSettings
from sysid.effect_selection.significance import Scores
from sysid.identification.linearisation import Linearisation
from sysid.identification.uncertainty import block_length, block_numbers
from sysid.objective import huber_weights, pseudo_residual

Array = NDArray[np.float64]
Columns = NDArray[np.int64]

# Numerical guards, not thresholds.
_RIDGE = 1e-10  # of the diagonal, against columns that depend on each other
_UNDETERMINED = 1e-6  # of what all blocks say of a column, by the other blocks
_LEAST_LEFT = 1e-3  # of a direction's power that a fit may leave of a block
_AT_BOUND = 1e-9  # of a parameter's range: rounding of a point on the bound


@dataclass(frozen=True)
class BlockRegression:
    """Residuals and P columns that may explain them, by blocks of rows.

    Normal equations are made only of the columns that are asked for: of hundreds, a
    candidate has a few.

    Attributes:
        A: (n, P) columns, each of rms 1; block by block.
        r: (n,) residuals, in units of the noise.
        begins: (B,) where each block begins.
        scale: (P,) what columns were divided by.
        side: (P,) 1 or -1 where a parameter can go up or down only, else 0.
        channels: number of channels of each row.
        huber_delta: residual, in standard deviations, beyond which the loss is linear.
        settings: how rows are weighted.
        noise: (n,) residuals as large as they are where nothing is fitted to them.
    """

    A: Array
    r: Array
    begins: NDArray[np.int64]
    scale: Array
    side: Array
    channels: int
    huber_delta: float
    settings: SelectionSettings
    noise: Array

    @classmethod
    def of(
        cls,
        linearisation: Linearisation,
        blocks: NDArray[np.int64],
        settings: SelectionSettings,
        extra: Array | None = None,
    ) -> Self:
        """Returns the regression of a linearisation.

        Args:
            linearisation: at the fit, with the candidates at null.
            blocks: (rows,) number of each row's block.
            settings: how rows are weighted.
            extra: (rows, channels, k) further columns, of dependence curves.
        """
        if extra is None:
            extra = np.zeros((*linearisation.residual.shape, 0))
        A = np.concatenate([linearisation.jacobian, extra], axis=2)
        r = linearisation.residual
        if (np.diff(blocks) < 0).any():  # else there is no need of a copy of all
            order = np.argsort(blocks, kind="stable")
            A, r, blocks = A[order], r[order], blocks[order]
        rows, channels, count = A.shape
        power = np.einsum("rcp,rcp->p", A, A) / max(rows * channels, 1)
        scale = np.maximum(np.sqrt(power), 1e-300)
        A /= scale
        r = r.reshape(-1)
        side = (linearisation.u < _AT_BOUND).astype(float) - (
            linearisation.u > 1.0 - _AT_BOUND
        )
        return cls(
            A.reshape(rows * channels, count),
            r,
            np.unique(blocks, return_index=True)[1] * channels,
            scale,
            np.append(side, np.zeros(extra.shape[2])),
            channels,
            linearisation.huber_delta,
            settings,
            r,
        )

    @property
    def block_losses(self) -> Array:
        """Loss of each block (B,) as it is: squares, Huber's beyond `huber_delta`."""
        return self._loss(self.r)

    def shifted(self, change: Array) -> "BlockRegression":
        """Returns the regression of the residuals at u + change (P,)."""
        r = self.r + self.A @ (change * self.scale)
        return dataclasses.replace(self, r=r, noise=r)

    def with_own_parameters(
        self, blocks: NDArray[np.bool_], size: int
    ) -> "BlockRegression":
        """Returns the regression with a second copy of parameters for some blocks.

        Args:
            blocks: (B,) those that the copies act in.
            size: number of the parameters that are copied, the first ones.
        """
        lengths = np.diff(self.begins, append=len(self.r))
        acts = np.repeat(blocks, lengths)[:, None]
        return dataclasses.replace(
            self,
            A=np.hstack([self.A, self.A[:, :size] * acts]),
            scale=np.concatenate([self.scale, self.scale[:size]]),
            side=np.zeros(len(self.scale) + size),
        )

    def project_out(self, base: Columns) -> "BlockRegression":
        """Returns the regression with some columns projected out, fitted to all rows.

        What a candidate adds is then judged apart from how well the base generalises:
        a base of many parameters, each fixed by a single block, would hide it. Columns
        that the base spans become zero.
        """
        if not len(base):
            return self
        own = self.A[:, base]
        weighted = self._weights(self.r)[:, None] * own
        H = (own.T @ weighted)[None]
        K = _solve(H, (weighted.T @ self.A)[None])[0]
        phi = -_solve(H, (weighted.T @ self.r)[None])[0]
        projected = own @ K
        np.subtract(self.A, projected, out=projected)  # of hundreds of columns
        left, size = (np.einsum("np,np->p", A, A) for A in (projected, self.A))
        projected *= left > self.settings.min_new_column**2 * size
        r = self.r + own @ phi
        return dataclasses.replace(self, A=projected, r=r, noise=r)

    def noise_left_by(self, base: Columns) -> Array:
        """Returns what a base leaves (n,), as large as if it had not been fitted.

        Of a block of few rows, a base of many parameters takes up a good part: (I -
        P_bb)^-1/2 r_b has the covariance of what was there before if that was white
        (Bell and McCaffrey 2002).
        """
        if not len(base):
            return self.r
        r = self.project_out(base).r
        root = np.sqrt(self._weights(r))
        own = root[:, None] * self.A[:, base]
        Q, size, _ = np.linalg.svd(own, full_matrices=False)
        Q = Q[:, size > _RIDGE * size.max(initial=0.0)]
        found = r.copy()
        for block in self._blocks:
            U, s, _ = np.linalg.svd(Q[block], full_matrices=False)
            more = 1.0 / np.sqrt(np.maximum(1.0 - s**2, _LEAST_LEFT)) - 1.0
            found[block] += (U @ (more * (U.T @ (root * r)[block]))) / np.maximum(
                root[block], 1e-300
            )
        return found

    @property
    def _blocks(self) -> list[slice]:
        ends = [*self.begins[1:], len(self.r)]
        return [slice(i, j) for i, j in zip(self.begins, ends, strict=True)]

    def held_out_losses(self, columns: Columns, back: Array | None = None) -> Array:
        """Returns the loss of each block (B,) with columns fitted to all others.

        Contact makes and breaks: at a few rows a derivative is huge and meaningless. So
        columns are fitted with and without limited leverage of such rows, outliers of
        the fit lose their influence, and the better of the two fits counts.

        Args:
            columns: which.
            back: (P,) from each parameter to its null, where it goes if the other
                blocks say nothing of it; None: null is here, and dependent columns
                are told apart as far as rounding allows.
        """
        return self._held_out(columns, back).losses

    def scores(self, columns: Columns) -> Scores:
        """Returns what the blocks say of columns that explain nothing by chance.

        The gradients g_b of the loss, decorrelated: their sum S has the squared length
        S^T V^-1 S, about chi-squared. V is half the gradients' own second moment, which
        no single block can exceed, and half that of white noise, which is well
        conditioned where blocks are few.
        """
        found = self._held_out(columns)
        noise = self._gradients(found.a, found.weights, self.noise)
        if not noise.any():
            return Scores(np.zeros(1), np.zeros((len(noise), 1)))
        L = _spread(found.H.sum(axis=0), noise)
        total = found.gradients.sum(axis=0)
        blocks = np.linalg.solve(L, noise.T).T
        total = np.asarray(np.linalg.solve(L, total))
        return Scores(total, np.asarray(blocks), self.least_p(columns))

    def least_p(self, columns: Columns) -> float:
        """Returns the least p-value that flips of the blocks' signs can give columns.

        Of columns that act in a few rows alone, whatever noise is there decides.
        """
        power = np.add.reduceat(self.A[:, columns] ** 2, self.begins)
        shares = (power / np.maximum(power.sum(axis=0), 1e-300)).sum(axis=1)
        count = shares.sum() ** 2 / max(float(np.sum(shares**2)), 1e-300)
        return float(min(1.0, 2.0 ** (1.0 - count)))

    def either_way(self) -> Self:
        """Returns the same with parameters that may go up and down."""
        return dataclasses.replace(self, side=np.zeros_like(self.side))

    def sensitivity(self, columns: Columns) -> Array:
        """Returns how long a total of `scores` each column makes by itself (k,).

        On the side of null on which it may be, wherever noise has pushed it here.
        """
        found = self.either_way()._held_out(columns)
        noise, H = self._gradients(found.a, found.weights, self.noise), found.H.sum(0)
        if not noise.any():
            return np.zeros(len(columns))
        lengths = np.linalg.solve(_spread(H, noise), H)
        return np.asarray(np.linalg.norm(lengths, axis=0))

    def _held_out(self, columns: Columns, back: Array | None = None) -> "_HeldOut":
        columns = self._feasible(columns)
        a = self.A[:, columns]
        own = None if back is None else (back * self.scale)[columns]
        priors = [np.ones(len(self.r))]
        if np.isfinite(self.huber_delta) and a.shape[1]:
            priors.append(self._leverage_weights(a))
        found = [self._cross_validated(a, w, own) for w in priors]
        return min(found, key=lambda each: float(each.losses.sum()))

    def _cross_validated(
        self, a: Array, prior: Array, back: Array | None
    ) -> "_HeldOut":
        """Returns how columns (n, k) fitted to all other blocks predict each.

        Args:
            a: columns.
            prior: (n,) weights of rows, times which Huber's are taken.
            back: (k,) to where what the others don't determine goes, if known.
        """
        w = prior * self._weights(self.r)
        H, g = self._normal_equations(a, w)
        null, weights = g, w
        if np.isfinite(self.huber_delta) and a.shape[1]:
            for _ in range(self.settings.reweighting_steps):
                phi = -_solve(H.sum(axis=0)[None], g.sum(axis=0)[None])[0]
                w = prior * self._weights(self.r + a @ phi)
                H, g = self._normal_equations(a, w)
        H_others, g_others = H.sum(axis=0) - H, g.sum(axis=0) - g
        if back is not None:
            weak = _UNDETERMINED * np.diagonal(H.sum(axis=0))
            H_others, g_others = H_others + np.diag(weak), g_others - weak * back
        others = -_solve(H_others, g_others)
        lengths = np.diff(self.begins, append=len(self.r))
        change = np.einsum("nk,nk->n", a, np.repeat(others, lengths, axis=0))
        return _HeldOut(self._loss(self.r + change), H, null, a, weights)

    def best_of(self, groups: Sequence[Columns]) -> Columns:
        """Returns the columns that explain most, by Akaike's criterion; or none.

        Fitted to all rows: quick, and no evidence.
        """
        w = self._weights(self.r)
        noise = float(np.mean(w * self.r**2))
        best, least = np.array([], dtype=np.int64), 0.0
        for columns in groups:
            a = self.A[:, columns]
            g = a.T @ (w * self.r)
            gain = float(g @ _solve((a.T @ (w[:, None] * a))[None], g[None])[0])
            criterion = 2.0 * len(columns) * noise - gain
            if criterion < least:
                best, least = columns, criterion
        return best

    def _leverage_weights(self, a: Array) -> Array:
        """Returns weights (n,) that give no row more leverage than most have."""
        size = np.abs(a).max(axis=1).reshape(-1, self.channels).max(axis=1)
        most = np.quantile(size, self.settings.leverage_quantile)
        weight = np.minimum(1.0, most / np.maximum(size, 1e-300)) ** 2
        return np.repeat(weight, self.channels)

    def _weights(self, r: Array) -> Array:
        """Returns the weights (n,) of residuals: Huber's, and less for outliers."""
        if not np.isfinite(self.huber_delta):
            return np.ones(len(r))
        limit = self.settings.outlier_deltas * self.huber_delta
        outlier = np.minimum(1.0, limit / np.maximum(np.abs(r), 1e-300))
        return huber_weights(r, self.huber_delta) * outlier**2

    def _loss(self, r: Array) -> Array:
        """Returns the loss of each block (B,) of residuals (n,)."""
        squares = pseudo_residual(r, self.huber_delta) ** 2
        return np.asarray(np.add.reduceat(squares, self.begins))

    def standard_errors(self) -> Array:
        """Returns the standard error (P,) of each parameter, all fitted together.

        A sandwich estimate from the blocks' gradients: right for any correlation within
        a block (Huber 1967).
        """
        parts_H, parts_g = self._normal_equations(self.A, self._weights(self.r))
        H = parts_H.sum(axis=0)
        size = np.sqrt(np.diagonal(H))
        size = np.where(size > 0.0, size, 1.0)
        H = H / np.outer(size, size)
        gradient = np.linalg.pinv(H, hermitian=True) @ (parts_g / size).T
        return np.asarray(np.linalg.norm(gradient, axis=1) / size / self.scale)

    def _normal_equations(self, a: Array, w: Array) -> tuple[Array, Array]:
        """Returns the normal equations of columns (n, k), (B, k, k) and (B, k)."""
        weighted = w[:, None] * a
        H = np.array([a[block].T @ weighted[block] for block in self._blocks])
        return H, self._gradients(a, w, self.r)

    def _gradients(self, a: Array, w: Array, r: Array) -> Array:
        """Returns the gradient of each block's loss (B, k), of residuals (n,)."""
        weighted = (w * r)[:, None] * a
        return np.asarray(np.add.reduceat(weighted, self.begins, axis=0))

    def _feasible(self, columns: Columns) -> Columns:
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


@dataclass(frozen=True)
class _HeldOut:
    """Columns fitted to all other blocks than each.

    Attributes:
        losses: (B,) of the blocks.
        H: (B, k, k) curvature of each block's loss.
        gradients: (B, k) of each block's loss where the columns explain nothing.
        a, weights: (n, k) and (n,) columns and weights of rows of the gradients.
    """

    losses: Array
    H: Array
    gradients: Array
    a: Array
    weights: Array


def blocks_of(
    residual: Array,
    episode: NDArray[np.int64],
    settings: SelectionSettings,
    most: int | None = None,
) -> NDArray[np.int64]:
    """Returns the block (rows,) of each row: longer than residuals stay correlated.

    Args:
        residual: (rows, channels).
        episode: (rows,) of each row; a block never spans two.
        settings: how many blocks there may be.
        most: blocks, if not the settings'.
    """
    rows = len(episode)
    length = block_length(residual, episode)
    length = max(length, rows // (most or settings.max_blocks))
    longest = max(1, rows // settings.min_blocks)
    return block_numbers(episode, int(min(length, longest)))


def _spread(H: Array, noise: Array) -> Array:
    """Returns L (k, k) with L L^T the spread of the sum of blocks' gradients (B, k)."""
    size = np.sqrt(np.maximum(np.diagonal(H), 1e-300))
    H, g = H / np.outer(size, size) + _RIDGE * np.eye(len(H)), noise / size
    own = g.T @ g
    level = np.trace(np.linalg.solve(H, own)) / len(H)
    return np.asarray(size[:, None] * np.linalg.cholesky(0.5 * (own + level * H)))


def _solve(H: Array, g: Array) -> Array:
    """Returns H^-1 g of a batch, with a tiny ridge against dependent columns."""
    size = H.shape[-1]
    diagonal = np.diagonal(H, axis1=1, axis2=2)
    ridge = _RIDGE * diagonal + 1e-300
    regular = H + ridge[:, :, None] * np.eye(size)
    if g.ndim == 2:
        return np.asarray(np.linalg.solve(regular, g[..., None])[..., 0])
    return np.asarray(np.linalg.solve(regular, g))
