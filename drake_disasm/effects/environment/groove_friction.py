"""The groove has more, or less, friction than in the model."""

import dataclasses
from typing import ClassVar

from drake_disasm.common.arrays import at_least
from drake_disasm.effects.base import BoltMotion, Environment, EnvironmentEffect
from drake_disasm.effects.fields import amplitude
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class GrooveFriction(EnvironmentEffect):
    """Coulomb friction that the nominal coefficient does not account for.

    Equation: mu = max(0, mu_nominal + coefficient), static = dynamic; the
    friction force is mu N against the sliding velocity (Coulomb).
    Where it acts: the contact material of the groove and of the bolt.
    """

    coefficient: float = amplitude("1", -1.0, 1.0, "added to the nominal mu")

    noun = "friction in the groove"
    experiment = "pulls both ways against one wall under two normal forces"
    experiments_against: ClassVar = {
        "GroovePose": (
            "the same pull both ways: friction changes its sign, geometry does not"
        ),
    }

    def apply(self, environment: Environment, bolt: BoltMotion) -> Environment:
        """Adds the coefficient, never below a frictionless groove."""
        friction = at_least(0.0, environment.friction + self.coefficient)
        return dataclasses.replace(environment, friction=friction)
