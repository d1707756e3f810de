"""The sensor's gains drift."""

import dataclasses
from typing import ClassVar

from drake_disasm.common.arrays import Array
from drake_disasm.effects.base import Sensing, SensorEffect
from drake_disasm.effects.fields import amplitude
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class SensorGainDrift(SensorEffect):
    """A relative error of each channel that grows with time.

    Equation: F_read = (1 + g t) F, channel by channel, g = [fx, fy, fz, tx, ty, tz],
    t the time since zeroing, or since the log began (readings that only have an order
    count one second each): the linear part of a strain gauge's temperature
    coefficient of sensitivity.
    Where it acts: the sensor's elements, on the whole load, the tool's weight included.
    """

    fx: float = amplitude("1/s", -0.3, 0.3, "growth of the force's error along x_S")
    fy: float = amplitude("1/s", -0.3, 0.3, "growth of the force's error along y_S")
    fz: float = amplitude("1/s", -0.3, 0.3, "growth of the force's error along z_S")
    tx: float = amplitude("1/s", -0.3, 0.3, "growth of the torque's error about x_S")
    ty: float = amplitude("1/s", -0.3, 0.3, "growth of the torque's error about y_S")
    tz: float = amplitude("1/s", -0.3, 0.3, "growth of the torque's error about z_S")

    noun = "a gain of the sensor that drifts"
    stage = 2
    task_experiment = "the same presses at the begin and at the end of a recording"
    experiment = "two known weights in turn, again and again while the sensor warms up"
    experiments_against: ClassVar = {
        "SensorGain": "the same loads at the begin and at the end of a recording",
        "SensorDrift": (
            "two known weights in turn, again and again: a drift of the zero is the "
            "same under both"
        ),
    }

    def apply(self, wrench_S: Array, sensing: Sensing) -> Array:
        """Scales the channels by their gains at this time."""
        rate = self.vector(wrench_S, "fx", "fy", "fz", "tx", "ty", "tz")
        return wrench_S + sensing.time[..., None] * rate * wrench_S
