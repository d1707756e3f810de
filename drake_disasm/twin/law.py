"""MSC Adams' IMPACT, the thesis's contact law (4.3)."""

import dataclasses

from drake_disasm.common.arrays import Array
from drake_disasm.parts import ImpactConfig


@dataclasses.dataclass(frozen=True)
class ImpactLaw:
    """F = max(0, k p^e + step(p, 0, 0, d, c) dp/dt) for p > 0, else 0 (thesis, 4.3).

    `step` is Adams' cubic, c x^2 (3 - 2 x) with x = p / d up to 1. Adams counts in mm,
    and so do the parameters. Computed by `equations.normal_force`. A
    parameter is a number, or an array (n,) with one for each of n states.

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

    @property
    def row(self) -> tuple[float | Array, ...]:
        """Its parameters as `normal_force` has them."""
        return (self.stiffness, self.exponent, self.damping, self.depth)
