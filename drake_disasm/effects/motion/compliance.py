"""Arm, gripper or sensor yield more than in the model."""

import dataclasses

from drake_disasm.common.arrays import Array
from drake_disasm.effects.base import Memory, MotionEffect
from drake_disasm.effects.fields import amplitude
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class Compliance(MotionEffect):
    """Arm, gripper and sensor yield to a force, and return.

    Equation: d_executed = d_commanded + C F with C = diag(x, y, z, u, v, w) and F the
    measured wrench on the bolt at Bo in G at the beginning of the step: slow motion,
    in which the compliance is in equilibrium. It is in series with the springs of
    the station.
    Where it acts: on the commanded pose, before inverse kinematics.
    """

    x: float = amplitude("m/N", 0.0, 4e-5, "compliance along x_G")
    y: float = amplitude("m/N", 0.0, 4e-5, "compliance along y_G")
    z: float = amplitude("m/N", 0.0, 4e-5, "compliance along z_G")
    u: float = amplitude("rad/(N m)", 0.0, 1.5e-3, "compliance about x_G")
    v: float = amplitude("rad/(N m)", 0.0, 1.5e-3, "compliance about y_G")
    w: float = amplitude("rad/(N m)", 0.0, 4e-4, "compliance about z_G")

    stage = 3
    noun = "compliance of arm and gripper"
    experiment = "the same steps under two loads"

    def execute(
        self, commanded: Array, wrench: Array, memory: Memory, period: float
    ) -> tuple[Array, Memory]:
        """See MotionEffect."""
        yields = self.vector(commanded, "x", "y", "z", "u", "v", "w")
        return commanded + yields * wrench, memory
