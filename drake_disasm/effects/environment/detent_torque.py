"""The detent is stiffer or weaker than in the model."""

import dataclasses
from typing import ClassVar

from drake_disasm.common.arrays import exponential
from drake_disasm.effects.base import BoltMotion, Environment, EnvironmentEffect
from drake_disasm.effects.fields import amplitude
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class DetentTorque(EnvironmentEffect):
    """A bayonet's detent holds with more, or less, torque than in the model.

    Equation: T = T_nominal exp(log_factor).
    Where it acts: a torque on the bolt about the part's y axis.
    """

    log_factor: float = amplitude("1", -2.0, 2.0, "natural logarithm of the factor")

    of_part: ClassVar[str] = "Bayonet"
    noun = "another torque of the detent"
    experiment = "slow turns out of the detent and back, without a pull"

    def apply(self, environment: Environment, bolt: BoltMotion) -> Environment:
        """Scales the detent's torque."""
        detent = environment.detent * exponential(self.log_factor)
        return dataclasses.replace(environment, detent=detent)
