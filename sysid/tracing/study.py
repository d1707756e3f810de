"""Residuals, and what would explain them, block by block.

Near a fit, residuals are linear in the parameters, those of candidate effects
included: r(phi) = r + A phi. All that is asked of a candidate (does it show, what does
it explain of data that it was not fitted to) follows from the normal equations of each
block of rows, so that hundreds of candidates cost no more simulations than one.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.stats import rankdata

from sysid.identification.linearisation import Linearisation
from sysid.identification.uncertainty import block_length, block_numbers

Array = NDArray[np.float64]
Columns = NDArray[np.int64]

_RIDGE = 1e-10  # of the diagonal, against columns that depend on each other
_DRAWS = 4000
_LEAST_BLOCKS = 8
_NEW = 1e-3  # share of a column that the base can't do
_MOST_BLOCKS = 40


@dataclass(frozen=True)
class Study:
    """Normal equations of B blocks for P columns.

    Attributes:
        H: (B, P, P) A^T W A of each block.
        g: (B, P) A^T W r.
        energy: (B,) r^T W r.
        count: (B,) residuals in each.
    """

    H: Array
    g: Array
    energy: Array
    count: Array

    @classmethod
    def of(cls, here: Linearisation, extra: Array, blocks: NDArray[np.int64]) -> Self:
        """Returns the study of a linearisation.

        Args:
            here: at the fit, with the candidates at null.
            extra: (rows, channels, k) further columns, of empirical dependences.
            blocks: (rows,) number of each row's block.
        """
        A = np.concatenate([here.jacobian, extra], axis=2)
        scale = np.sqrt(np.mean(A**2, axis=(0, 1)))
        A = A / np.maximum(scale, 1e-300)
        parts = [cls._block(here, A, blocks == b) for b in range(int(blocks.max()) + 1)]
        return cls(*(np.array(part) for part in zip(*parts, strict=True)))

    @staticmethod
    def _block(
        here: Linearisation, A: Array, mask: NDArray[np.bool_]
    ) -> tuple[Array, Array, float, int]:
        a = A[mask].reshape(-1, A.shape[2])
        r, w = here.residual[mask].reshape(-1), here.weights[mask].reshape(-1)
        wa = w[:, None] * a
        return a.T @ wa, wa.T @ r, float(w @ r**2), len(r)

    def beside(self, base: Columns) -> "Study":
        """Returns the study of all columns with some projected out, fitted to all rows.

        What a candidate adds is then judged apart from how well the base carries over:
        a base of many parameters that a block fixes alone would drown it. Columns
        that the base can do are zero.
        """
        H = self.H.sum(axis=0)
        K = _solve(H[np.ix_(base, base)][None], H[base][None])[0]
        phi = -_solve(H[np.ix_(base, base)][None], self.g[:, base].sum(axis=0)[None])[0]
        cross = np.einsum("ib,nij->nbj", K, self.H[:, base])
        inner = np.einsum("ib,nij,jc->nbc", K, self.H[:, base][:, :, base], K)
        g = self.g + np.einsum("nij,j->ni", self.H[:, :, base], phi)
        energy = (
            self.energy
            + 2.0 * self.g[:, base] @ phi
            + np.einsum("i,nij,j->n", phi, self.H[:, base][:, :, base], phi)
        )
        projected = self.H - cross - cross.swapaxes(1, 2) + inner
        left, size = (np.diagonal(each.sum(axis=0)) for each in (projected, self.H))
        new = (left > _NEW**2 * size).astype(float)
        return Study(
            projected * new[:, None] * new,
            (g - g[:, base] @ K) * new,
            energy,
            self.count,
        )

    def losses(self, columns: Columns) -> Array:
        """Returns what each block costs, (B,), if columns are fitted to all others."""
        H, g = self.H[:, columns][:, :, columns], self.g[:, columns]
        rest_H, rest_g = H.sum(axis=0) - H, g.sum(axis=0) - g
        phi = -_solve(rest_H, rest_g)
        fit = np.einsum("bi,bij,bj->b", phi, H, phi) + 2.0 * np.sum(phi * g, axis=1)
        return self.energy + fit


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


def blocks_of(here: Linearisation, episode: NDArray[np.int64]) -> NDArray[np.int64]:
    """Returns the block (rows,) of each row: longer than residuals stay correlated."""
    rows = len(episode)
    length = block_length(here.residual, episode)
    length = max(length, rows // _MOST_BLOCKS)
    return block_numbers(episode, int(min(length, max(1, rows // _LEAST_BLOCKS))))


def _solve(H: Array, g: Array) -> Array:
    """Returns H^-1 g of a batch, a little ridge against dependent columns."""
    size = H.shape[-1]
    diagonal = np.diagonal(H, axis1=1, axis2=2)
    ridge = _RIDGE * diagonal + 1e-300
    regular = H + ridge[:, :, None] * np.eye(size)
    if g.ndim == 2:
        return np.asarray(np.linalg.solve(regular, g[..., None])[..., 0])
    return np.asarray(np.linalg.solve(regular, g))
