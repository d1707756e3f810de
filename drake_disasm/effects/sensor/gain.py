"""The sensor reads too much or too little."""

import dataclasses

import numpy as np

from drake_disasm.effects.base import Sensing, SensorEffect
from drake_disasm.effects.fields import amplitude
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class SensorGain(SensorEffect):
    """Each channel reads a constant share too much.

    Equation: F_read = (1 + g) F, channel by channel, g = [fx, fy, fz, tx, ty, tz].
    Where it acts: the force/torque sensor's calibration; zeroing sees it.
    """

    fx: float = amplitude("1", -0.5, 0.5, "share too much of the force along x_S")
    fy: float = amplitude("1", -0.5, 0.5, "share too much of the force along y_S")
    fz: float = amplitude("1", -0.5, 0.5, "share too much of the force along z_S")
    tx: float = amplitude("1", -0.5, 0.5, "share too much of the torque about x_S")
    ty: float = amplitude("1", -0.5, 0.5, "share too much of the torque about y_S")
    tz: float = amplitude("1", -0.5, 0.5, "share too much of the torque about z_S")

    stage = 2

    def apply(self, wrench_S: np.ndarray, sensing: Sensing) -> np.ndarray:
        """Stretches the channels."""
        gain = np.array([self.fx, self.fy, self.fz, self.tx, self.ty, self.tz])
        return wrench_S + gain * wrench_S
