"""The arm moves further, or less far, than commanded."""

import dataclasses

from drake_disasm.common.arrays import Array
from drake_disasm.effects.base import Memory, MotionEffect
from drake_disasm.effects.fields import amplitude
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class CommandGain(MotionEffect):
    """A scale error of the commanded motion: wrong link lengths or gear ratios.

    Equation: d_executed = (1 + diag(k)) d_commanded, d the displacement from the start
    (position and rotation vector of B in G), k = [x, y, z, u, v, w].
    Where it acts: on the commanded pose, before inverse kinematics.
    """

    x: float = amplitude("1", -0.5, 0.5, "relative error of the displacement along x_G")
    y: float = amplitude("1", -0.5, 0.5, "relative error of the displacement along y_G")
    z: float = amplitude("1", -0.5, 0.5, "relative error of the displacement along z_G")
    u: float = amplitude("1", -0.5, 0.5, "relative error of the rotation about x_G")
    v: float = amplitude("1", -0.5, 0.5, "relative error of the rotation about y_G")
    w: float = amplitude("1", -0.5, 0.5, "relative error of the rotation about z_G")

    noun = "a scale error of the motion"
    experiment = "steps of several lengths in free space"

    def execute(
        self, commanded: Array, wrench: Array, memory: Memory, period: float
    ) -> tuple[Array, Memory]:
        """See MotionEffect."""
        gain = self.vector(commanded, "x", "y", "z", "u", "v", "w")
        return commanded + gain * commanded, memory
