"""MSC Adams' IMPACT, the thesis's contact law (4.3)."""

import dataclasses

import numpy as np

from drake_disasm.scenario import ImpactConfig

_MM = 1000.0
_LEAST = 1e-12  # mm: a power of zero has no slope


@dataclasses.dataclass(frozen=True)
class ImpactLaw:
    """F = max(0, k p^e + step(p, 0, 0, d, c) dp/dt) for p > 0, else 0 (thesis, 4.3).

    `step` is Adams' cubic, c x^2 (3 - 2 x) with x = p / d up to 1. Adams counts in mm,
    and so do the parameters; arguments and results are SI.

    Attributes:
        stiffness: k [N/mm^e].
        exponent: e [1].
        damping: c [N s/mm].
        depth: d [mm], at which damping is full.
    """

    stiffness: float
    exponent: float
    damping: float
    depth: float

    @classmethod
    def of(cls, config: ImpactConfig) -> "ImpactLaw":
        """Returns the law of a scenario's section."""
        return cls(**dataclasses.asdict(config))

    def force(self, penetration: np.ndarray, rate: np.ndarray) -> np.ndarray:
        """Returns the normal force (n,) [N].

        Args:
            penetration: (n,) [m].
            rate: (n,) of the penetration [m/s].
        """
        return self.force_and_slopes(penetration, rate)[0]

    def force_and_slopes(
        self, penetration: np.ndarray, rate: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Returns F [N], dF/dp [N/m] and dF/d(dp/dt) [N s/m], (n,) each."""
        p = np.maximum(penetration * _MM, _LEAST)
        x = np.minimum(p / self.depth, 1.0) if self.depth else np.ones_like(p)
        elastic = self.stiffness * p**self.exponent
        damping = self.damping * x * x * (3.0 - 2.0 * x)
        force = elastic + damping * rate * _MM
        acts = (penetration > 0.0) & (force > 0.0)
        ramp = self.damping * 6.0 * x * (1.0 - x) / max(self.depth, _LEAST)
        slope = elastic * self.exponent / p + ramp * rate * _MM
        return acts * force, acts * slope * _MM, acts * damping * _MM
