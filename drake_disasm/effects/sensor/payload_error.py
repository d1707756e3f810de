"""The tool was weighed wrongly."""

import dataclasses

from drake_disasm.common.arrays import Array, cross, namespace
from drake_disasm.effects.base import Sensing, SensorEffect
from drake_disasm.effects.fields import amplitude
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class PayloadError(SensorEffect):
    """The payload has another mass or first moment than the tool data say.

    Equation: f_S += R_SW g m, tau_S += c x (R_SW g), where m is the missing mass
    and c = [cx, cy, cz] the missing first mass moment m p_SoScm in S. (With the
    moment rather than the centre of mass as parameter the reading is linear in
    all four and vanishes at zero; the error of the centre of mass is c over the
    tool's mass.)
    Where it acts: the reading of the force/torque sensor, at rest or in slow
    motion, where inertial forces are negligible. Zeroing sees it.
    """

    mass: float = amplitude("kg", -10.0, 10.0, "mass missing in the tool data")
    cx: float = amplitude("kg m", -2.0, 2.0, "first moment missing, along x_S")
    cy: float = amplitude("kg m", -2.0, 2.0, "first moment missing, along y_S")
    cz: float = amplitude("kg m", -2.0, 2.0, "first moment missing, along z_S")

    stage = 0
    removed_by_zeroing = True
    noun = "an error of the payload"
    experiment = "six or more orientations, with and without the tool"
    task_experiment = "steps in free space that turn the bolt: a weight turns with it"

    def apply(self, wrench_S: Array, sensing: Sensing) -> Array:
        """Adds the weight that the tool data lack."""
        g_S = sensing.g_S
        torque = cross(self.vector(g_S, "cx", "cy", "cz"), g_S)
        force = self.column("mass") * g_S
        return wrench_S + namespace(g_S).concat([force, torque], axis=-1)
