"""The groove has more friction at low speed."""

import dataclasses

from drake_disasm.common.arrays import (
    as_number,
    at_least,
    exponential,
    namespace,
)
from drake_disasm.effects.base import (
    BoltMotion,
    Environment,
    EnvironmentEffect,
    Reach,
)
from drake_disasm.effects.fields import amplitude, shape_parameter
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class GrooveStribeckFriction(EnvironmentEffect):
    """Friction that is higher at low speed (Stribeck 1902).

    Equation: mu += a exp(-(|v| / v_s)^2), v the velocity commanded for this
    step; mu stays at or above zero.
    Where it acts: the contact material of the groove and of the bolt.
    """

    coefficient: float = amplitude("1", -1.0, 1.0, "a, added at rest")
    velocity: float = shape_parameter(
        0.01, "m/s", 1e-4, 1.0, "v_s, at which most of it is gone", (0.005, 0.015)
    )

    is_local = True
    noun = "friction in the groove that falls with speed"
    experiment = "pulls under one normal force, from very slow to fast"

    @classmethod
    def greatest_shapes(cls, reach: Reach) -> dict[str, float]:
        """See Effect: what hardly falls at any speed is friction at each."""
        return {"velocity": reach.speed}

    def apply(self, environment: Environment, bolt: BoltMotion) -> Environment:
        """Adds what is left at this speed."""
        speed = as_number(namespace(bolt.v).sum(bolt.v**2, axis=-1)) ** 0.5
        added = self.coefficient * exponential(-((speed / self.velocity) ** 2))
        friction = at_least(0.0, environment.friction + added)
        return dataclasses.replace(environment, friction=friction)
