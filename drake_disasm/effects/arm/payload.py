"""Bodies that hang on an arm, and that its model lacks."""

from abc import ABC

import numpy as np

from drake_disasm.effects.base import ArmEffect

_LIGHTEST = 0.1  # kg, below which a payload's own inertia is bounded


class PayloadEffect(ArmEffect, ABC):
    """A point mass on a link, by its mass and first moment in the link's frame B.

    Attributes:
        mass: [kg].
        cx, cy, cz: first moment m p_BoPcm_B [kg m].
    """

    is_whole = True
    mass: float
    cx: float
    cy: float
    cz: float

    @property
    def first_moment(self) -> np.ndarray:
        """(3,) mass times centre of mass, in B [kg m]."""
        return np.array([self.cx, self.cy, self.cz])

    @property
    def inertia(self) -> np.ndarray:
        """(3, 3) about Bo, in B [kg m^2]."""
        c = self.first_moment
        return (c @ c * np.eye(3) - np.outer(c, c)) / max(self.mass, _LIGHTEST)

    @property
    def inertial(self) -> np.ndarray:
        """(10,) [m, cx, cy, cz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz] about Bo, in B."""
        upper = self.inertia[np.triu_indices(3)]
        return np.concatenate([[self.mass], self.first_moment, upper])
