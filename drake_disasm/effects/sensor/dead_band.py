"""The sensor does not report small loads."""

import dataclasses

from drake_disasm.common.arrays import Array, last_axis, namespace
from drake_disasm.effects.base import Sensing, SensorEffect
from drake_disasm.effects.fields import amplitude, shape_parameter
from drake_disasm.effects.registry import register_effect

_LEVER = 0.05  # m, by which a width of force becomes one of torque
_EDGE = 0.05  # of the width: the sensor's noise blurs the band's edges


@register_effect
@dataclasses.dataclass
class SensorDeadBand(SensorEffect):
    """Readings within a band are reported as zero: a threshold, or a dead zone.

    Equation: F_read = F - a ((1 - h) F + h b W sign F), channel by channel, with h =
    1 / (1 + exp((W - |F|) / 0.05 W)) about 0 within the band and 1 outside; half width
    W for forces and 0.05 m W for torques; F less the weight of the known payload. With
    a = 1 the band reads zero; beyond it b = 0 reads the whole load (threshold), b = 1
    the load less W (dead zone; Slotine and Li 1991, section 5.2).
    Where it acts: the last filter before the reading is reported, which compensates
    the payload's weight.
    """

    force: float = amplitude("1", 0.0, 1.2, "a of the forces, 1: they read zero")
    torque: float = amplitude("1", 0.0, 1.2, "a of the torques, 1: they read zero")
    width: float = shape_parameter(
        0.5, "N", 0.01, 50.0, "W, half width of the band", (0.3, 1.0, 3.0)
    )
    beyond: float = shape_parameter(
        0.0, "1", 0.0, 1.0, "b, share of W that is missing beyond the band", (0.0, 1.0)
    )

    noun = "a dead band of the sensor"
    stage = 5
    experiment = "a load that grows slowly through zero, along each axis of the sensor"

    def apply(self, wrench_S: Array, sensing: Sensing) -> Array:
        """Takes off what the band hides."""
        xp = namespace(wrench_S)
        load = wrench_S - sensing.weight
        width = last_axis([self.width] * 3 + [_LEVER * self.width] * 3, wrench_S)
        share = last_axis([self.force] * 3 + [self.torque] * 3, wrench_S)
        # The logistic function, which does not overflow as a tangent.
        beyond = (xp.abs(load) - width) / (_EDGE * width)
        outside = 0.5 + 0.5 * xp.tanh(beyond / 2.0)
        hidden = (1.0 - outside) * load
        missing = self.column("beyond") * outside * width * xp.sign(load)
        return wrench_S - share * (hidden + missing)
