"""The sensor's gains are off."""

import dataclasses
from typing import ClassVar

from drake_disasm.common.arrays import Array
from drake_disasm.effects.base import Sensing, SensorEffect
from drake_disasm.effects.fields import amplitude
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class SensorGain(SensorEffect):
    """Each channel has a constant relative error.

    Equation: F_read = (1 + g) F, channel by channel, g = [fx, fy, fz, tx, ty, tz].
    Where it acts: the force/torque sensor's calibration; zeroing sees it.
    """

    fx: float = amplitude("1", -0.5, 0.5, "relative error of the force along x_S")
    fy: float = amplitude("1", -0.5, 0.5, "relative error of the force along y_S")
    fz: float = amplitude("1", -0.5, 0.5, "relative error of the force along z_S")
    tx: float = amplitude("1", -0.5, 0.5, "relative error of the torque about x_S")
    ty: float = amplitude("1", -0.5, 0.5, "relative error of the torque about y_S")
    tz: float = amplitude("1", -0.5, 0.5, "relative error of the torque about z_S")

    stage = 2
    noun = "a gain error of the sensor"
    experiment = "known weights of several sizes, along each axis of the sensor"
    task_experiment = "presses of several forces along each axis of the groove"
    experiments_against: ClassVar = {
        "PayloadError": (
            "the same poses with a second, known weight: an error of the payload "
            "stays, one of the gain grows"
        ),
    }

    def apply(self, wrench_S: Array, sensing: Sensing) -> Array:
        """Scales the channels."""
        gain = self.vector(wrench_S, "fx", "fy", "fz", "tx", "ty", "tz")
        return wrench_S + gain * wrench_S
