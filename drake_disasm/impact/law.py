"""MSC Adams' IMPACT, the thesis's contact law (4.3)."""

import dataclasses
from typing import Self

from drake_disasm.common.arrays import Array, at_least, at_most, namespace
from drake_disasm.scenario import ImpactConfig

_MM = 1000.0
_LEAST = 1e-12  # mm: a power of zero has no slope


@dataclasses.dataclass(frozen=True)
class ImpactLaw:
    """F = max(0, k p^e + step(p, 0, 0, d, c) dp/dt) for p > 0, else 0 (thesis, 4.3).

    `step` is Adams' cubic, c x^2 (3 - 2 x) with x = p / d up to 1. Adams counts in mm,
    and so do the parameters; arguments and results are SI. A parameter is a number, or
    an array with one for each of n states; arrays are NumPy's or torch's.

    Attributes:
        stiffness: k [N/mm^e].
        exponent: e [1].
        damping: c [N s/mm].
        depth: d [mm], at which damping is full.
    """

    stiffness: float | Array
    exponent: float | Array
    damping: float | Array
    depth: float | Array

    @classmethod
    def of(cls, config: ImpactConfig) -> "ImpactLaw":
        """Returns the law of a scenario's section."""
        return cls(**dataclasses.asdict(config))

    def select(self, states: Array) -> Self:
        """Returns the law of some states, by index (c,)."""
        parts = (self.stiffness, self.exponent, self.damping, self.depth)
        return type(self)(
            *(p if isinstance(p, float) else _take(p, states) for p in parts)
        )

    def force(self, penetration: Array, rate: Array) -> Array:
        """Returns the normal force (n,) [N].

        Args:
            penetration: (n,) [m].
            rate: (n,) of the penetration [m/s].
        """
        return self.force_and_slopes(penetration, rate)[0]

    def force_and_slopes(
        self, penetration: Array, rate: Array
    ) -> tuple[Array, Array, Array]:
        """Returns F [N], dF/dp [N/m] and dF/d(dp/dt) [N s/m], (n,) each."""
        xp = namespace(penetration)
        p: Array = at_least(_LEAST, penetration * _MM)
        depth = at_least(_LEAST, self.depth)
        x = at_most(1.0, p / depth)
        elastic = self.stiffness * p**self.exponent
        damping = self.damping * x * x * (3.0 - 2.0 * x)
        force = elastic + damping * rate * _MM
        acts = xp.astype((penetration > 0.0) & (force > 0.0), p.dtype)
        ramp = self.damping * 6.0 * x * (1.0 - x) / depth
        slope = elastic * self.exponent / p + ramp * rate * _MM
        return acts * force, acts * slope * _MM, acts * damping * _MM


def _take(values: Array, index: Array) -> Array:
    return namespace(values).take(values, index, axis=0)
