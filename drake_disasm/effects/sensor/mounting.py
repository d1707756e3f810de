"""The sensor is mounted rotated."""

import dataclasses
from typing import ClassVar

from drake_disasm.common.arrays import Array, apply_matrix, namespace, transposed
from drake_disasm.common.rotations import rotation_matrices
from drake_disasm.effects.base import Sensing, SensorEffect
from drake_disasm.effects.fields import amplitude
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class SensorMounting(SensorEffect):
    """The sensor is mounted rotated about its origin from its nominal orientation.

    Equation: F_read = R^T F for force and torque, R = Exp([rx, ry, rz]) the sensor's
    true orientation in S.
    Where it acts: between flange and sensor; zeroing sees it.
    """

    rx: float = amplitude("rad", -0.5, 0.5, "rotation about x_S")
    ry: float = amplitude("rad", -0.5, 0.5, "rotation about y_S")
    rz: float = amplitude("rad", -0.5, 0.5, "rotation about z_S")

    stage = 1
    noun = "a turned mounting of the sensor"
    experiment = (
        "the same poses with two known weights, gravity along each axis of the sensor "
        "in turn"
    )
    task_experiment = "presses along one axis of the groove at a time"
    experiments_against: ClassVar = {
        "BaseTilt": (
            "the arm's base, or its first joint, rotated: a tilt is fixed to the "
            "world, the mounting to the sensor"
        ),
    }

    def apply(self, wrench_S: Array, sensing: Sensing) -> Array:
        """Expresses the wrench in the true axes."""
        R = transposed(rotation_matrices(self.vector(wrench_S, "rx", "ry", "rz")))
        parts = (wrench_S[..., :3], wrench_S[..., 3:])
        return namespace(wrench_S).concat(
            [apply_matrix(R, part) for part in parts], axis=-1
        )
