"""An arm whose base does not stand level."""

import dataclasses

from drake_disasm.effects.base import ArmEffect
from drake_disasm.effects.fields import amplitude
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class ArmTilt(ArmEffect):
    """The arm's base is tilted against the vertical.

    Equation: tau = dtau/dg . dg with dg = |g| [ry, -rx, 0], the change of gravity in
    the base's frame to first order; inertial parameters that only the tilt reveals are
    those of the URDF.
    Where it acts: every joint of the arm, on the torques that their sensors measure.
    """

    rx: float = amplitude("rad", -0.5, 0.5, "rotation of the base about x_W")
    ry: float = amplitude("rad", -0.5, 0.5, "rotation of the base about y_W")

    noun = "a tilted base of the arm"
    experiment = "rests with the arm stretched out, turned about the vertical"
