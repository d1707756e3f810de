"""The sensor is mounted turned."""

import dataclasses

import numpy as np

from drake_disasm.common.spatial import rotation_from_vector
from drake_disasm.effects.base import Sensing, SensorEffect
from drake_disasm.effects.fields import amplitude
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class SensorMounting(SensorEffect):
    """The sensor is turned about its origin against where the model has it.

    Equation: F_read = R^T F for force and torque, R = Exp([rx, ry, rz]) the sensor's
    true orientation in S.
    Where it acts: between flange and sensor; zeroing sees it.
    """

    rx: float = amplitude("rad", -0.5, 0.5, "turned about x_S")
    ry: float = amplitude("rad", -0.5, 0.5, "turned about y_S")
    rz: float = amplitude("rad", -0.5, 0.5, "turned about z_S")

    stage = 1

    def apply(self, wrench_S: np.ndarray, sensing: Sensing) -> np.ndarray:
        """Expresses the wrench in the turned axes."""
        R = rotation_from_vector(np.array([self.rx, self.ry, self.rz])).matrix()
        return np.concatenate([wrench_S[..., :3] @ R, wrench_S[..., 3:] @ R], axis=-1)
