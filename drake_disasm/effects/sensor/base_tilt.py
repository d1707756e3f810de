"""The robot's base is not level."""

import dataclasses

from drake_disasm.common.arrays import (
    Array,
    apply_matrix,
    last_axis,
    transposed,
)
from drake_disasm.common.rotations import rotation_matrices
from drake_disasm.effects.base import Sensing, SensorEffect
from drake_disasm.effects.fields import amplitude
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class BaseTilt(SensorEffect):
    """The robot's base is tilted: gravity has another direction than assumed.

    Equation: g_W = Exp([rx, ry, 0]) g; what hangs on the sensor, m at c, loads it with
    f = R_SW (g_W - g) m more, and c x f. A groove that is tilted along with the base
    is GroovePose.
    Where it acts: the weight of the payload, before the sensor.
    """

    rx: float = amplitude("rad", -0.2, 0.2, "tilt about x_W")
    ry: float = amplitude("rad", -0.2, 0.2, "tilt about y_W")

    stage = -1
    removed_by_zeroing = True
    noun = "a tilted base"
    experiment = "the same orientations of the sensor with the arm's base turned"

    def circumstances(self, sensing: Sensing) -> Sensing:
        """Returns the circumstances under the true gravity."""
        R = self._tilt(sensing.g_W)
        return dataclasses.replace(sensing, g_W=apply_matrix(R, sensing.g_W))

    def apply(self, wrench_S: Array, sensing: Sensing) -> Array:
        """Adds the change of the payload's weight; `sensing` has the true gravity."""
        R = self._tilt(sensing.g_W)
        believed = apply_matrix(transposed(R), sensing.g_W)
        change = dataclasses.replace(sensing, g_W=sensing.g_W - believed)
        return wrench_S + change.weight

    def _tilt(self, like: Array) -> Array:
        return rotation_matrices(last_axis([self.rx, self.ry, 0.0], like))
