"""Torque of a joint that depends periodically on its position."""

import dataclasses

import numpy as np

from drake_disasm.effects.base import JointEffect, JointSamples
from drake_disasm.effects.fields import amplitude, joint_name, shape_parameter
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class TorqueRipple(JointEffect):
    """Cogging of a motor, or an error of a gear's teeth or of the torque sensor.

    Equation: tau = s sin(n q) + c cos(n q), n periods per turn (for a prismatic joint
    per 2 pi metres). A strain-wave gear has two per turn of its wave generator.
    Where it acts: one joint of the arm, on the torque that its sensor measures. One
    period per turn is what an offset of the centre of mass looks like; less than a
    whole period within a motion is a curve of the position like any other, no ripple.
    """

    joint: str = joint_name()
    sine: float = amplitude("N m", -200.0, 200.0, "s, in phase with the position")
    cosine: float = amplitude("N m", -200.0, 200.0, "c, a quarter of a period ahead")
    periods: float = shape_parameter(
        4.0, "1/rad", 0.5, 2000.0, "n, periods per turn", (2.0, 4.0, 8.0)
    )

    noun = "torque ripple"
    experiment = "this joint slowly over its whole range, both ways, the others at rest"
    rest_experiment = (
        "rests of this joint close together over its whole range, the others unmoved"
    )

    def torque(self, samples: JointSamples) -> np.ndarray:
        """See JointEffect."""
        phase = self.periods * samples.q
        return self.sine * np.sin(phase) + self.cosine * np.cos(phase)

    @classmethod
    def least_shapes(cls, travel: float) -> dict[str, float]:
        """See JointEffect: a whole period."""
        return {"periods": 2.0 * np.pi / max(travel, 1e-9)}
