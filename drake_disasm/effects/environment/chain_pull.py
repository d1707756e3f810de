"""The door chain, or a spring, pulls on the bolt."""

import dataclasses

import numpy as np

from drake_disasm.effects.base import BoltMotion, Environment, EnvironmentEffect
from drake_disasm.effects.fields import amplitude
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class ChainPull(EnvironmentEffect):
    """A force on the bolt beside the contact, constant or growing with travel.

    Equation: f = [fx, fy, fz] - [k x, 0, 0] in Gn, x the travel at the beginning of the
    step. Zeroing the sensor takes the constant part out of the readings; the arm
    yields to it all the same.
    Where it acts: a force on the bolt at Bo.
    """

    fx: float = amplitude("N", -30.0, 30.0, "constant, along x_G")
    fy: float = amplitude("N", -30.0, 30.0, "constant, along y_G")
    fz: float = amplitude("N", -30.0, 30.0, "constant, along z_G")
    k: float = amplitude("N/m", -500.0, 500.0, "of a spring that pulls back to A")

    is_local = True

    def apply(self, environment: Environment, bolt: BoltMotion) -> Environment:
        """Adds the pull at this place."""
        pull = [self.fx - self.k * bolt.p[0], self.fy, self.fz]
        fx, fy, fz = np.array(environment.force_Gn) + pull
        return dataclasses.replace(
            environment, force_Gn=(float(fx), float(fy), float(fz))
        )
