"""How certain an estimate is: intervals for white and for correlated residuals."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import fftconvolve

from sysid import confidence
from sysid.identification.linearisation import Linearisation

Array = NDArray[np.float64]

_DRAWS = 2000
_SMALL = 1e-2  # of the largest channel's power
_UNCORRELATED = 0.05  # autocorrelation from which on there is none


@dataclass(frozen=True)
class Uncertainty:
    """Spread of an estimate, in the unit box.

    Attributes:
        covariance: (p, p) by Gauss-Newton: valid if residuals are white, whatever
            their size in each channel.
        curvature: (p, p) by the objective's curvature alone: valid if residuals of
            all channels have the same variance, too.
        draws: (b, p) block bootstrap of the estimate: valid if residuals further
            apart than a block are independent.
        block: length of a block in rows.
    """

    covariance: Array
    curvature: Array
    draws: Array
    block: int

    @property
    def gauss_newton(self) -> Array:
        """95 % intervals (p, 2) by the covariance, relative to the estimate."""
        half = confidence.Z * np.sqrt(np.diagonal(self.covariance))
        return np.column_stack([-half, half])

    @property
    def bootstrap(self) -> Array:
        """95 % intervals (p, 2) by the bootstrap, relative to the estimate."""
        return np.quantile(self.draws, confidence.QUANTILES, axis=0).T

    @property
    def bootstrap_covariance(self) -> Array:
        """Covariance (p, p) of the bootstrap's draws."""
        return np.atleast_2d(np.cov(self.draws.T))

    @property
    def correlation(self) -> Array:
        """Correlation (p, p) of the bootstrap's draws."""
        C = self.bootstrap_covariance
        root = np.sqrt(np.maximum(np.diagonal(C), 1e-300))
        return C / np.outer(root, root)


def uncertainty(
    linearisation: Linearisation, episode: NDArray[np.int64], seed: int = 0
) -> Uncertainty:
    """Returns the uncertainty of the estimate at which residuals were linearised.

    The bootstrap draws blocks of rows with replacement, and takes one weighted
    Gauss-Newton step for each draw: no simulation is needed. A block is twice as
    long as residuals stay correlated.

    Args:
        linearisation: at the estimate.
        episode: (rows,) of each row; a block never spans two.
        seed: of the draws.
    """
    block = block_length(linearisation.residual, episode)
    blocks = block_numbers(episode, block)
    inverse: Array = np.array(np.linalg.pinv(linearisation.information, hermitian=True))
    return Uncertainty(
        _white(linearisation, inverse),
        np.array(_mean_square(linearisation) * inverse),
        _block_bootstrap(linearisation, blocks, seed),
        block,
    )


def block_length(residual: Array, episode: NDArray[np.int64]) -> int:
    """Returns twice the rows over which residuals (rows, channels) are correlated.

    The longest over channels of the integrated autocorrelation time, summed until
    it first falls to _UNCORRELATED; at most a tenth of the rows. A channel with far
    less power than the others has no weight in the estimate, and does not count.
    """
    limit = max(1, len(residual) // 10)
    centred = residual - residual.mean(axis=0)
    power = np.mean(centred**2, axis=0)
    rho = _products(centred, episode)[1:limit] / np.maximum(power, 1e-300)
    falling = np.logical_and.accumulate(rho > _UNCORRELATED) & (
        power > _SMALL * power.max()
    )
    longest = float(np.max(1.0 + 2.0 * np.sum(rho, axis=0, where=falling)))
    return int(np.clip(np.ceil(2.0 * longest), 1, limit)) if longest > 1.0 else 1


def _products(values: Array, episode: NDArray[np.int64]) -> Array:
    """Returns the mean products (rows, channels) of values that many rows apart.

    Both of one episode; null where there are none.
    """
    sums, counts = np.zeros_like(values), np.zeros((len(values), 1))
    for number in np.unique(episode):
        part = values[episode == number]
        n = len(part)
        sums[:n] += fftconvolve(part, part[::-1], axes=0)[n - 1 :]
        counts[:n] += np.arange(n, 0, -1)[:, None]
    return np.asarray(sums / np.maximum(counts, 1.0))


def block_numbers(episode: NDArray[np.int64], length: int) -> NDArray[np.int64]:
    """Returns the number of the block (rows,) that each row falls into."""
    row = np.zeros(len(episode), dtype=np.int64)
    for number in np.unique(episode):
        mask = episode == number
        row[mask] = np.arange(mask.sum()) // length
    _, blocks = np.unique(np.column_stack([episode, row]), axis=0, return_inverse=True)
    numbers: NDArray[np.int64] = np.asarray(blocks).reshape(-1)
    return numbers


def _mean_square(linearisation: Linearisation) -> float:
    r, w = linearisation.residual, linearisation.weights
    return float(np.sum(w * r**2) / max(1, r.size - len(linearisation.u)))


def _white(linearisation: Linearisation, inverse: Array) -> Array:
    """Returns the covariance (p, p) of an estimate from white residuals.

    H^-1 (sum_c s_c^2 J_c^T J_c) H^-1 with H = J^T W J and s_c^2 = mean (w r)^2 of
    channel c (Huber 1981, 7.6); s^2 H^-1 where all channels have the same power.
    """
    J, w, r = linearisation.jacobian, linearisation.weights, linearisation.residual
    dof = max(1, r.size - len(linearisation.u))
    power = np.mean((w * r) ** 2, axis=0) * r.size / dof
    B = np.einsum("rci,c,rcj->ij", J, power, J)
    return np.array(inverse @ B @ inverse)


def _block_bootstrap(
    linearisation: Linearisation, blocks: NDArray[np.int64], seed: int
) -> Array:
    """Returns draws (b, p) of the estimate's error."""
    J, w, r = linearisation.jacobian, linearisation.weights, linearisation.residual
    count = int(blocks.max()) + 1
    size = len(linearisation.u)
    H, g = np.zeros((count, size, size)), np.zeros((count, size))
    np.add.at(H, blocks, np.einsum("rci,rc,rcj->rij", J, w, J))
    np.add.at(g, blocks, np.einsum("rci,rc,rc->ri", J, w, r))
    # A draw's own optimum: what is left of the gradient at the estimate is not noise.
    g = g - g.mean(axis=0)
    generator = np.random.default_rng(seed)
    times = generator.multinomial(count, np.full(count, 1.0 / count), _DRAWS)
    drawn_H = np.tensordot(times, H, 1)
    drawn_g = times @ g
    inverse = np.linalg.pinv(drawn_H, hermitian=True)
    return -np.einsum("bij,bj->bi", inverse, drawn_g)
