"""The groove has more friction at one place."""

import dataclasses

from drake_disasm.common.arrays import as_number, at_least, exponential
from drake_disasm.effects.base import (
    BoltMotion,
    Environment,
    EnvironmentEffect,
    Reach,
)
from drake_disasm.effects.fields import amplitude, shape_parameter
from drake_disasm.effects.registry import register_effect

_WIDEST = 1.0 / 3.0  # of the way: from its middle to the ends it falls to a tenth


@register_effect
@dataclasses.dataclass
class RustyPatch(EnvironmentEffect):
    """A patch of rust or dirt: friction that depends on the position.

    Equation: mu += a exp(-((x - x_0) / w)^2), x the travel of the bolt; mu stays at or
    above zero.
    Where it acts: the contact material of the groove and of the bolt.
    """

    coefficient: float = amplitude(
        "1", -1.0, 2.0, "a, added in the middle of the patch"
    )
    position: float = shape_parameter(
        0.03,
        "m",
        -0.02,
        0.1,
        "x_0, its middle",
        (0.005, 0.015, 0.025, 0.035, 0.045, 0.055),
    )
    width: float = shape_parameter(
        0.008, "m", 0.001, 0.1, "w, its half width", (0.008,)
    )

    is_local = True
    noun = "a patch of friction in the groove"
    experiment = "slow pulls over the whole groove, both ways, under one normal force"

    @classmethod
    def greatest_shapes(cls, reach: Reach) -> dict[str, float]:
        """See Effect: what is wider is friction everywhere."""
        return {"width": _WIDEST * reach.way}

    def apply(self, environment: Environment, bolt: BoltMotion) -> Environment:
        """Adds the friction at this place."""
        away = (as_number(bolt.p[..., 0]) - self.position) / self.width
        added = self.coefficient * exponential(-(away**2))
        friction = at_least(0.0, environment.friction + added)
        return dataclasses.replace(environment, friction=friction)
