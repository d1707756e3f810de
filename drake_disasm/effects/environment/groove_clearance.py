"""The bolt has more, or less, clearance in the slot."""

import dataclasses

from drake_disasm.common.arrays import at_least, at_most
from drake_disasm.effects.base import BoltMotion, Environment, EnvironmentEffect
from drake_disasm.effects.fields import amplitude
from drake_disasm.effects.registry import register_effect

_LEAST = 2e-5  # m, the least clearance: the bolt still fits its slot


@register_effect
@dataclasses.dataclass
class GrooveClearance(EnvironmentEffect):
    """The slot is wider or narrower than in the model: wear, dirt, tolerance.

    Equation: clearance = max(0.02 mm, nominal + change), the slot's width minus the
    neck's diameter.
    Where it acts: the lips of the groove in the scene graph.
    """

    change: float = amplitude("m", -5e-4, 1e-3, "added to the clearance")

    noun = "a groove of another width"
    experiment = "small steps sideways from wall to wall, at several depths"

    def apply(self, environment: Environment, bolt: BoltMotion) -> Environment:
        """Changes the clearance."""
        nominal = environment.clearance
        clearance = at_least(at_most(_LEAST, nominal), nominal + self.change)
        return dataclasses.replace(environment, clearance=clearance)
