"""The groove is bent."""

import dataclasses

from drake_disasm.common.arrays import as_number, last_axis
from drake_disasm.common.rotations import pose_from_vectors
from drake_disasm.effects.base import BoltMotion, Environment, EnvironmentEffect
from drake_disasm.effects.fields import amplitude
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class GrooveBend(EnvironmentEffect):
    """The groove's axis is an arc instead of a line.

    Equation: at travel x the axis is displaced by c(x) = [0, ky x^2 / 2, kz x^2 / 2]
    and rotated by its slope; the bolt meets a straight groove that is tangent to the
    arc there.
    Where it acts: the pose of the lock in the plant, anew in each step of the MDP.
    """

    ky: float = amplitude("1/m", -2.0, 2.0, "curvature out of the plate")
    kz: float = amplitude("1/m", -2.0, 2.0, "curvature across the groove")

    is_local = True
    noun = "a bent groove"
    experiment = "slow pulls over the whole groove, both ways and along both walls"

    def apply(self, environment: Environment, bolt: BoltMotion) -> Environment:
        """Composes the tangent groove at the bolt onto the pose so far."""
        x = as_number((environment.X_GnG.inverse() @ bolt.p)[..., 0])
        turn = last_axis([0.0, -self.kz * x, self.ky * x], bolt.p)
        c = last_axis([x, self.ky * x**2 / 2.0, self.kz * x**2 / 2.0], bolt.p)
        here = pose_from_vectors(turn, 0.0 * c)
        p = c - here @ last_axis([x, 0.0, 0.0], bolt.p)
        tangent = pose_from_vectors(turn, p)
        return dataclasses.replace(environment, X_GnG=environment.X_GnG @ tangent)
