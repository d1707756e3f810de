"""The contact is stiffer or softer than in the model."""

import dataclasses

from drake_disasm.common.arrays import exponential
from drake_disasm.effects.base import BoltMotion, Environment, EnvironmentEffect
from drake_disasm.effects.fields import amplitude
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class ContactStiffness(EnvironmentEffect):
    """Bolt and groove yield less, or more, than their nominal materials.

    Equation: k = k_nominal exp(log_factor) for the hydroelastic moduli and for
    IMPACT's stiffness.
    Where it acts: the contact material of the bolt, or IMPACT's law.
    """

    log_factor: float = amplitude("1", -5.0, 5.0, "natural logarithm of the factor")

    noun = "another stiffness of the contact"
    experiment = "slow presses against one wall, up to three forces or more"

    def apply(self, environment: Environment, bolt: BoltMotion) -> Environment:
        """Scales the stiffness."""
        factor = exponential(self.log_factor)
        return dataclasses.replace(
            environment,
            modulus=environment.modulus * factor,
            head_modulus=environment.head_modulus * factor,
            impact_stiffness=environment.impact_stiffness * factor,
        )
