"""What the bodies of a part are made of, and by which law they touch."""

import dataclasses

from drake_disasm.common.quantity import quantity


@dataclasses.dataclass
class ImpactConfig:
    """MSC Adams' IMPACT (thesis 4.3), in Adams' units: N, mm, s. Of the twin alone."""

    stiffness: float = quantity(1e3, "N/mm^e", "k of k p^e", low=0.0, high=1e5)
    exponent: float = quantity(1.0, "1", "e of k p^e", low=0.0, high=5.0)
    damping: float = quantity(1.0, "N s/mm", "when fully deep", low=0.0, high=1000.0)
    depth: float = quantity(0.1, "mm", "at which damping is full", low=0.0, high=1.0)


@dataclasses.dataclass
class ContactConfig:
    """How bolt and groove touch.

    Hydroelastic: the groove is rigid, the bolt's neck and head are compliant.
    `impact` is the thesis's law instead, with the friction of this section.
    """

    model: str = quantity(
        "hydroelastic", "", "of contact", choices=("hydroelastic", "impact")
    )
    impact: ImpactConfig = dataclasses.field(default_factory=ImpactConfig)
    modulus: float = quantity(
        4e9, "Pa", "hydroelastic modulus of the bolt's neck", low=1e6, high=1e11
    )
    head_modulus: float = quantity(
        4e7, "Pa", "hydroelastic modulus of the bolt's head", low=1e5, high=1e11
    )
    dissipation: float = quantity(20.0, "s/m", "Hunt-Crossley", low=0.0, high=500.0)
    friction: float = quantity(0.2, "1", "Coulomb, static = dynamic", low=0, high=2)
    resolution: float = quantity(
        0.0008, "m", "edge length on the bolt's mesh", low=1e-4, high=5e-3
    )
