"""Current by torque of each joint, from torques of which a part is known.

The current of joint j is

    i_j = a_j (t_j + S_j theta) + F_j f_j + noise,        a_j = 1 / k_j,

with known torques t_j, what all joints share but nobody knows (bodies, theta), and what
is the joint's own (friction and rotor, f_j, in amperes). Gautier and Briot (2014),
"Global identification of joint drive gains and dynamic parameters of robots", J. Dyn.
Syst. Meas. Control 136(5), have the model; they solve it by total least squares. Here
only the currents have noise, and the sum of squares is least over theta and f for every
a, and least over a.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize, minimize_scalar
from scipy.stats import t as student

from sysid.confidence import QUANTILES
from sysid.models.channel_grams import jackknife_error

Array = NDArray[np.float64]

#: Contiguous blocks of rows, without each of which constants are fitted for their
#: intervals: long against the noise's correlation, and enough for a standard error.
_BLOCKS = 16
_RANK = 1e-10  # of the largest eigenvalue of the scaled products
_START = (-5.0, 3.0)  # log10 of a common a [A/(N m)]: any motor is between


@dataclass(frozen=True)
class CurrentGrams:
    """Products of [t, S, F, i] of each joint, by contiguous blocks of rows.

    Attributes:
        G: (blocks, joints, m, m).
        shared: number of columns of S.
        weights: (joints,) inverse variances of the currents' noise [1/A^2].
    """

    G: Array
    shared: int
    weights: Array

    @classmethod
    def of(cls, known: Array, shared: Array, own: Array, current: Array) -> Self:
        """Sums the products.

        Args:
            known: (n, joints) torques [N m].
            shared: (n, joints, s) what joints share [N m per unit].
            own: (n, joints, f) columns of each joint alone.
            current: (n, joints) [A].
        """
        parts = [known[..., None], shared, own, current[..., None]]
        columns = np.swapaxes(np.concatenate(parts, axis=2), 0, 1)
        G = np.array(
            [
                np.swapaxes(block, 1, 2) @ block
                for block in np.array_split(columns, _BLOCKS, axis=1)
            ]
        )
        whole = G.sum(axis=0)
        left = [_left(g[:-1, :-1], g[:-1, -1], g[-1, -1]) for g in whole]
        floor = np.finfo(float).eps * whole[:, -1, -1] + 1e-300
        return cls(G, shared.shape[2], len(known) / np.maximum(left, floor))

    def fit(self, start: Array | None = None, without: int | None = None) -> Array:
        """Returns a (joints,) of the least squares.

        Args:
            start: (joints,) from which it is sought; None for one common to all.
            without: number of a block that is left out.
        """
        kept = self.G if without is None else np.delete(self.G, without, axis=0)
        G = kept.sum(axis=0)
        joints = len(G)
        if start is None:
            common = minimize_scalar(
                lambda x: self.loss(np.full(joints, 10.0**x), G)[0],
                bounds=_START,
                method="bounded",
            )
            start = np.full(joints, 10.0**common.x)
        scale = np.abs(start)

        def _scaled(x: Array) -> tuple[float, Array]:
            loss, gradient = self.loss(scale * x, G)
            return loss, scale * gradient

        return np.asarray(scale * minimize(_scaled, start / scale, jac=True).x)

    def half_widths(self, a: Array) -> Array:
        """Returns half the widths (joints,) of 95 % intervals, by the jackknife."""
        without = np.array([self.fit(a, k) for k in range(len(self.G))])
        errors = np.array([jackknife_error(own) for own in without.T])
        return np.asarray(student.ppf(QUANTILES[1], len(without) - 1) * errors)

    def loss(self, a: Array, G: Array) -> tuple[float, Array]:
        """Returns the sum of squares at the best theta and f, and its gradient by a.

        By the envelope theorem, the gradient is that at constant theta and f.
        """
        theta, u = self._solved(a, G)
        products = np.einsum("jmn,jn->jm", G, u)
        left = np.einsum("jm,jm->j", u, products)
        load = np.concatenate([[1.0], theta])
        slope = 2.0 * products[:, : 1 + self.shared] @ load
        return float(self.weights @ left), np.asarray(self.weights * slope)

    @property
    def explained(self) -> Array:
        """What known torques alone explain (joints,) of what a joint's own leave."""
        without = np.r_[1 + self.shared : self.G.shape[2] - 1]
        both = np.r_[0, without]
        found = []
        for g in self.G.sum(axis=0):
            less, more = (
                _left(g[np.ix_(chosen, chosen)], g[chosen, -1], g[-1, -1])
                for chosen in (without, both)
            )
            found.append(1.0 - more / less if less > 0.0 else 0.0)
        return np.array(found)

    def theta(self, a: Array) -> Array:
        """Returns what joints share (s,), at some a."""
        return self._solved(a, self.G.sum(axis=0))[0]

    def _solved(self, a: Array, G: Array) -> tuple[Array, Array]:
        """Returns theta (s,), and u (joints, m) with the residuals [t, S, F, i] u."""
        s, f = self.shared, G.shape[1] - self.shared - 2
        joints = len(a)
        size = s + joints * f
        N, r = np.zeros((size, size)), np.zeros(size)
        S, F = slice(1, 1 + s), slice(1 + s, 1 + s + f)
        for j, (weight, g) in enumerate(zip(self.weights, G, strict=True)):
            own = slice(s + j * f, s + (j + 1) * f)
            target = g[:, -1] - a[j] * g[:, 0]
            N[:s, :s] += weight * a[j] ** 2 * g[S, S]
            N[:s, own] = weight * a[j] * g[S, F]
            N[own, :s] = N[:s, own].T
            N[own, own] = weight * g[F, F]
            r[:s] += weight * a[j] * target[S]
            r[own] = weight * target[F]
        x = _solution(N, r)
        u = np.empty((joints, G.shape[1]))
        u[:, 0] = a
        u[:, S] = a[:, None] * x[:s]
        u[:, F] = x[s:].reshape(joints, f)
        u[:, -1] = -1.0
        return x[:s], u


def _solution(N: Array, r: Array) -> Array:
    """Returns the least x of normal equations; directions of rounding are zero."""
    size = np.sqrt(np.diagonal(N))
    size = np.where(size > 0.0, size, 1.0)
    values, vectors = np.linalg.eigh(N / np.outer(size, size))
    kept = values > _RANK * values[-1]
    along = vectors[:, kept].T @ (r / size) / values[kept]
    return np.asarray(vectors[:, kept] @ along / size)


def _left(N: Array, r: Array, square: float) -> float:
    """Returns the sum of squares that least squares leave."""
    return float(square - r @ _solution(N, r))
