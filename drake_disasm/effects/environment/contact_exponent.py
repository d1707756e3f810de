"""The contact force grows with another power of the penetration."""

import dataclasses

from drake_disasm.common.arrays import at_least
from drake_disasm.effects.base import BoltMotion, Environment, EnvironmentEffect
from drake_disasm.effects.fields import amplitude
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class ContactExponent(EnvironmentEffect):
    """The normal force grows with another power of the penetration.

    Equation: F = k p^(e + change) of IMPACT (thesis 4.3), p in mm; at least zero.
    Where it acts: IMPACT's law; hydroelastic contact has no exponent and ignores it.
    """

    change: float = amplitude("1", -1.0, 3.0, "added to the exponent e")

    contact_models = ("impact",)
    noun = "another exponent of the contact"
    experiment = "slow presses against one wall, from light to strong"

    def apply(self, environment: Environment, bolt: BoltMotion) -> Environment:
        """Changes the exponent."""
        exponent = at_least(0.0, environment.impact_exponent + self.change)
        return dataclasses.replace(environment, impact_exponent=exponent)
