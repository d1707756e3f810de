"""A body on a link that the arm's URDF does not have."""

import dataclasses

from drake_disasm.effects.arm.payload import PayloadEffect
from drake_disasm.effects.fields import amplitude, joint_name
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class LinkPayload(PayloadEffect):
    """A body on the link that a joint moves, which the arm's URDF does not have.

    Equation: tau = Y_B(q, v, vd) pi, with Y_B the arm's regressor of a body in the
    frame B of that link, and pi as of FlangePayload.
    Where it acts: every joint between the base and the link. It shows where the other
    links are known: against a URDF that is trusted, or against reference logs.
    """

    joint: str = joint_name()
    mass: float = amplitude("kg", 0.0, 50.0, "mass of the body")
    cx: float = amplitude("kg m", -10.0, 10.0, "first moment along x_B")
    cy: float = amplitude("kg m", -10.0, 10.0, "first moment along y_B")
    cz: float = amplitude("kg m", -10.0, 10.0, "first moment along z_B")

    noun = "a body on the link"
    experiment = "rests in several poses, with and without what is mounted there"
