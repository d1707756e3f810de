"""The sensor has an offset."""

import dataclasses

from drake_disasm.common.arrays import Array
from drake_disasm.effects.base import Sensing, SensorEffect
from drake_disasm.effects.fields import amplitude
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class SensorBias(SensorEffect):
    """An offset, constant in the sensor's frame, that arose after zeroing.

    Equation: F_read = F + b with b = [fx, fy, fz, tx, ty, tz] in S.
    Where it acts: the reading of the force/torque sensor. Zeroing does not see
    it; an offset that was there before is what zeroing removes.
    """

    fx: float = amplitude("N", -50.0, 50.0, "force offset along x_S")
    fy: float = amplitude("N", -50.0, 50.0, "force offset along y_S")
    fz: float = amplitude("N", -50.0, 50.0, "force offset along z_S")
    tx: float = amplitude("N m", -5.0, 5.0, "torque offset about x_S")
    ty: float = amplitude("N m", -5.0, 5.0, "torque offset about y_S")
    tz: float = amplitude("N m", -5.0, 5.0, "torque offset about z_S")

    present_at_zeroing = False
    noun = "an offset of the sensor"
    experiment = (
        "readings in six or more orientations, which turn the weight but not an offset"
    )
    task_experiment = "steps in free space, where an offset stays and contact does not"

    def apply(self, wrench_S: Array, sensing: Sensing) -> Array:
        """Adds the offset."""
        return wrench_S + self.vector(wrench_S, "fx", "fy", "fz", "tx", "ty", "tz")
