"""Periodic motions of an arm: Fourier series that begin and end at rest."""

import dataclasses
from typing import Self

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclasses.dataclass(frozen=True)
class FourierMotion:
    """Joint positions as finite Fourier series (Swevers et al. 1997).

    q(t) = centre + sum_k [a_k sin(k w t) - b_k cos(k w t)] / (k w), with w = 2 pi /
    duration: band-limited, so that recorded positions can be averaged over periods and
    differentiated without error.

    Attributes:
        centre: (joints,) [rad or m].
        a, b: (joints, harmonics) [rad/s or m/s].
        duration: of one period [s].
    """

    centre: Array
    a: Array
    b: Array
    duration: float

    @property
    def harmonics(self) -> int:
        """Number of them."""
        return self.a.shape[1]

    def at_rest(self) -> Self:
        """Returns the nearest motion whose velocity and acceleration begin with zero.

        v(0) = sum_k a_k and vd(0) = w sum_k k b_k.
        """
        k = np.arange(1, self.harmonics + 1)
        a = self.a - self.a.mean(axis=1, keepdims=True)
        b = self.b - np.outer(self.b @ k / (k @ k), k)
        return dataclasses.replace(self, a=a, b=b)

    def from_posture(self, q: Array) -> Self:
        """Returns the motion, moved so that it begins in a posture (joints,)."""
        w = 2.0 * np.pi * np.arange(1, self.harmonics + 1) / self.duration
        return dataclasses.replace(self, centre=q + (self.b / w).sum(axis=1))

    def scaled(self, factors: Array | float) -> Self:
        """Returns the motion about its centre, times a factor for each joint."""
        by = np.reshape(factors, (-1, 1))
        return dataclasses.replace(self, a=by * self.a, b=by * self.b)

    def states(self, time: Array) -> tuple[Array, Array, Array]:
        """Returns q, v and vd, (n, joints) each, at times (n,) [s]."""
        w = 2.0 * np.pi * np.arange(1, self.harmonics + 1) / self.duration
        sine, cosine = np.sin(np.outer(time, w)), np.cos(np.outer(time, w))
        q = self.centre + sine @ (self.a / w).T - cosine @ (self.b / w).T
        v = cosine @ self.a.T + sine @ self.b.T
        vd = cosine @ (self.b * w).T - sine @ (self.a * w).T
        return q, v, vd
