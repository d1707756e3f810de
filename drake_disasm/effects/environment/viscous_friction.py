"""Grease between bolt and groove."""

import dataclasses

from drake_disasm.common.arrays import as_number
from drake_disasm.effects.base import BoltMotion, Environment, EnvironmentEffect
from drake_disasm.effects.fields import amplitude
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class GrooveViscousFriction(EnvironmentEffect):
    """A drag that grows with speed, whatever the normal force: grease.

    Equation: f = -c v, v the velocity commanded for this step.
    Where it acts: a force on the bolt at Bo.
    """

    coefficient: float = amplitude("N s/m", 0.0, 1000.0, "c, the drag per velocity")

    is_local = True
    noun = "viscous drag in the groove"
    experiment = "pulls under one normal force at three or more speeds"

    def apply(self, environment: Environment, bolt: BoltMotion) -> Environment:
        """Adds the drag."""
        fx, fy, fz = (
            force - self.coefficient * as_number(bolt.v[..., axis])
            for axis, force in enumerate(environment.force_Gn)
        )
        return dataclasses.replace(environment, force_Gn=(fx, fy, fz))
