"""The robot's base is not level."""

import dataclasses

import numpy as np

from drake_disasm.common.spatial import rotation_from_vector
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
        return dataclasses.replace(sensing, g_W=self._R @ sensing.g_W)

    def apply(self, wrench_S: np.ndarray, sensing: Sensing) -> np.ndarray:
        """Adds the change of the payload's weight; `sensing` has the true gravity."""
        believed = self._R.T @ sensing.g_W
        change = sensing.mass * ((sensing.g_W - believed) @ sensing.R_WS)
        torque = np.cross(sensing.p_SoScm_S, change)
        return wrench_S + np.concatenate([change, torque], axis=-1)

    @property
    def _R(self) -> np.ndarray:
        return rotation_from_vector(np.array([self.rx, self.ry, 0.0])).matrix()
