"""The door chain, or a spring, pulls on the bolt."""

import dataclasses

from drake_disasm.common.arrays import as_number
from drake_disasm.effects.base import BoltMotion, Environment, EnvironmentEffect
from drake_disasm.effects.fields import amplitude
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class ChainPull(EnvironmentEffect):
    """A force on the bolt besides the contact, constant or growing with travel.

    Equation: f = [fx, fy, fz] - [k x, 0, 0] in Gn, x the travel at the beginning of the
    step. Zeroing the sensor removes the constant part from the readings; the arm still
    yields to it.
    Where it acts: a force on the bolt at Bo.
    """

    fx: float = amplitude("N", -30.0, 30.0, "constant, along x_G")
    fy: float = amplitude("N", -30.0, 30.0, "constant, along y_G")
    fz: float = amplitude("N", -30.0, 30.0, "constant, along z_G")
    k: float = amplitude(
        "N/m", -500.0, 500.0, "stiffness of a spring that pulls back to A"
    )

    is_local = True
    noun = "a constant pull on the bolt"
    experiment = "the same pull both ways: a chain keeps its sign, friction does not"

    def apply(self, environment: Environment, bolt: BoltMotion) -> Environment:
        """Adds the pull at this place."""
        fx, fy, fz = environment.force_Gn
        back = as_number(self.k * bolt.p[..., 0])
        return dataclasses.replace(
            environment, force_Gn=(fx + self.fx - back, fy + self.fy, fz + self.fz)
        )
