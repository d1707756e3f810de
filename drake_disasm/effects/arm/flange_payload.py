"""A payload on the flange that the controller does not know of."""

import dataclasses

from drake_disasm.effects.arm.payload import PayloadEffect
from drake_disasm.effects.fields import amplitude
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class FlangePayload(PayloadEffect):
    """A payload on the arm's last link that the arm's model lacks.

    Equation: tau = Y_F(q, v, vd) pi, with Y_F the arm's regressor of a body in the
    frame F of its last link (the flange), and pi = [m, c, I] mass, first moment
    c = m p_FoPcm_F and inertia about Fo of a point mass, I = (c.c 1 - c c^T) / m
    (Khalil and Dombre 2002). With the moment as parameter, rather than the centre
    of mass, all but I is linear; I is bounded below 0.1 kg, where it has no meaning.
    Where it acts: every joint of the arm, on the torques that their sensors
    measure. It can't be distinguished from an error of the last link's mass. In the
    cell it loads the flange, before the force/torque sensor, and the gravity
    compensation does not carry it: the joints yield by tau / k.
    """

    mass: float = amplitude("kg", 0.0, 50.0, "mass of the payload")
    cx: float = amplitude("kg m", -10.0, 10.0, "first moment along x_F")
    cy: float = amplitude("kg m", -10.0, 10.0, "first moment along y_F")
    cz: float = amplitude("kg m", -10.0, 10.0, "first moment along z_F")

    noun = "a payload on the flange"
    experiment = "rests in several poses, with and without what hangs there"
