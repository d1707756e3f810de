"""Search spaces: a box, and coordinates whitened about an estimate."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drake_disasm.common.errors import DisasmError

Points = NDArray[np.float64]

#: Values (b,) of a batch of points (b, p).
BatchFunction = Callable[[Points], Points]


@dataclass(frozen=True)
class Box:
    """Bounds of a search, inclusive.

    Attributes:
        low, high: (p,) corners.
    """

    low: Points
    high: Points

    @classmethod
    def of(cls, low: ArrayLike, high: ArrayLike) -> Self:
        """Returns the box between two corners.

        Raises:
            DisasmError: bounds are not finite, or reversed, or there are none.
        """
        a, b = np.array(low, dtype=float), np.array(high, dtype=float)
        if a.shape != b.shape or a.ndim != 1 or not len(a):
            raise DisasmError(
                "bounds: low and high differ in shape or are empty; give (p,) each, "
                "with at least one element"
            )
        if not (np.isfinite(a).all() and np.isfinite(b).all()):
            raise DisasmError("bounds: are not finite; a search needs a box")
        if (a >= b).any():
            raise DisasmError("bounds: a low is not below its high; swap them")
        return cls(a, b)

    @classmethod
    def unit(cls, size: int) -> Self:
        """Returns [0, 1]^size."""
        return cls.of(np.zeros(size), np.ones(size))

    @property
    def size(self) -> int:
        """Number of dimensions."""
        return len(self.low)

    @property
    def width(self) -> Points:
        """Edge lengths (p,)."""
        return self.high - self.low

    def sample(self, count: int, generator: np.random.Generator) -> Points:
        """Returns points (count, p), uniformly."""
        return generator.uniform(self.low, self.high, (count, self.size))

    def clip(self, points: Points) -> Points:
        """Returns points clipped to the box."""
        return np.clip(points, self.low, self.high)


@dataclass(frozen=True)
class Whitened:
    """Coordinates z with x = x0 + L z, clipped to the box of x.

    About a linear or Gauss-Newton estimate x0 with covariance C = L L^T the
    objective looks the same in every direction of z, where in x it may be a narrow
    valley that no box-aligned neighbourhood fits.

    Attributes:
        x0: (p,) the estimate.
        L: (p, p) a factor of its covariance.
        inner: the box of x.
        radius: |z_i| to search, in standard deviations.
    """

    x0: Points
    L: Points
    inner: Box
    radius: float = 5.0

    @property
    def box(self) -> Box:
        """The box of z."""
        size = len(self.x0)
        return Box.of(np.full(size, -self.radius), np.full(size, self.radius))

    def to_x(self, z: Points) -> Points:
        """Returns points (..., p) of x."""
        return self.inner.clip(self.x0 + z @ self.L.T)

    def wrap(self, function: BatchFunction) -> BatchFunction:
        """Returns a function of x as one of z."""
        return lambda z: function(self.to_x(z))
