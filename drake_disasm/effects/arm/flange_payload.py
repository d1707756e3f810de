"""A payload on the flange that the controller does not know of."""

import dataclasses

import numpy as np

from drake_disasm.effects.base import ArmEffect
from drake_disasm.effects.fields import amplitude
from drake_disasm.effects.registry import register_effect

_LIGHTEST = 0.1  # kg, below which a payload's own inertia is bounded


@register_effect
@dataclasses.dataclass
class FlangePayload(ArmEffect):
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

    @property
    def first_moment(self) -> np.ndarray:
        """(3,) mass times centre of mass, in F [kg m]."""
        return np.array([self.cx, self.cy, self.cz])

    @property
    def inertia(self) -> np.ndarray:
        """(3, 3) about Fo, in F [kg m^2]."""
        c = self.first_moment
        return (c @ c * np.eye(3) - np.outer(c, c)) / max(self.mass, _LIGHTEST)

    @property
    def inertial(self) -> np.ndarray:
        """(10,) [m, cx, cy, cz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz] about Fo, in F."""
        upper = self.inertia[np.triu_indices(3)]
        return np.concatenate([[self.mass], self.first_moment, upper])
