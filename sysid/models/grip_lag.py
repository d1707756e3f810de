"""By how much the grip gives when a step begins, which no encoder measures."""

import dataclasses
import functools
from typing import Self

import numpy as np
from pydrake.math import RigidTransform

from drake_disasm.cell.grip import AXIS_ORDER, Springs
from drake_disasm.cell.twin_parameters import twin_of
from drake_disasm.common.spatial import velocity_shift
from drake_disasm.scenario import Scenario
from sysid.models.base import Array
from sysid.models.sensor_reading import at_bolt

_FORGOTTEN = 0.1  # of a step: with less, e^-10 of what was before is left


@dataclasses.dataclass(frozen=True)
class GripLag:
    """Splits a measured wrench into what the grip's springs and its dampers carry.

    A spring and a damper in parallel (Kelvin and Voigt): w = k d + c d', so that the
    deflection d follows w / k with a lag of c / k, 0.06 s for the grip that yields. A
    bolt that has just run into a stop loads its sensor by the dampers alone: springs
    that carried all of it would have the bolt a step's travel behind. Between two
    steps the wrench is taken for linear in time.

    A stiff grip has forgotten what was at the begin; when in the step a force came,
    nobody knows, and the springs carry all of it.

    Attributes:
        springs: of the grip, at the pads in Gn.
        to_grip: (6, 6) wrench at the pads by that on the bolt at Bo, in Gn.
        period: of the task [s].
    """

    springs: Springs
    to_grip: Array
    period: float

    @classmethod
    def of(cls, scenario: Scenario) -> Self:
        """Returns the lag of a scenario's grip."""
        twin = twin_of(scenario)
        to_grip = velocity_shift(twin.p_BoTo_B).T
        return cls(twin.grip, to_grip, scenario.task.period)

    @property
    def lags(self) -> bool:
        """Whether springs are slow enough for a step's begin to matter at its end."""
        lag = self.springs.damping / self.springs.stiffness
        return bool(lag.max() > _FORGOTTEN * self.period)

    def after(self, elastic: Array, wrench: Array) -> Array:
        """Returns the springs' wrench (n, 6) at the end of steps, at Bo in Gn.

        Args:
            elastic: (n, 6) the springs' at the begin.
            wrench: (n, 2, 6) measured at begin and end, [f; tau].
        """
        if not self.lags:
            return wrench[:, 1]
        parts = np.stack([elastic, wrench[:, 0], wrench[:, 1]], axis=1) @ self.to_grip.T
        return self.from_pads(np.sum(self._weights * parts, axis=1))

    def along(self, wrench: Array) -> Array:
        """Returns the springs' wrench (n, 6) along an episode, from the first row on.

        Args:
            wrench: (n, 6) measured, [f; tau] at Bo in Gn.
        """
        if not self.lags:
            return wrench
        forgets, of_begin, of_end = self._weights
        elastic = wrench @ self.to_grip.T
        elastic[1:] = of_begin * elastic[:-1] + of_end * elastic[1:]
        for k in range(1, len(elastic)):
            elastic[k] += forgets * elastic[k - 1]
        return self.from_pads(elastic)

    @functools.cached_property
    def _weights(self) -> Array:
        """Of the springs' wrench and the measured one at begin and end (3, 6)."""
        lag = self.springs.damping / self.springs.stiffness
        forgets = np.exp(-self.period / lag)
        of_begin = lag / self.period * (1.0 - forgets) - forgets
        return np.array([forgets, of_begin, 1.0 - forgets - of_begin])

    def from_pads(self, at_grip: Array) -> Array:
        """Returns wrenches (n, 6) at Bo in Gn, of those at the pads."""
        return np.asarray(np.linalg.solve(self.to_grip, at_grip.T).T)

    def deflections(self, wrench: Array) -> Array:
        """Returns by how much the grip gives at rest (n, 6) [m, rad], along Gn.

        Args:
            wrench: (n, 6) on the bolt at Bo in Gn, [f; tau].
        """
        return np.asarray(wrench @ self.to_grip.T / self.springs.stiffness)

    def carried(self, give: Array, weight: Array) -> Array:
        """Returns the springs' wrench (n, 6) at Bo in Gn where the grip has given way.

        The inverse of `drake_disasm.cell.grip.deflection`.

        Args:
            give: (n, 6) in the twin's coordinates.
            weight: (3,) of what the sensor carries, in Gn [N].
        """
        given = give[:, list(AXIS_ORDER)]
        at_grip = given * self.springs.stiffness
        at_grip[:, 3:] += np.cross(given[:, :3], at_grip[:, :3] + weight)
        return self.from_pads(at_grip)

    def after_growth(self, wrench: Array) -> Array:
        """Returns the springs' share (n, 6) of a wrench that grew evenly in a step.

        Args:
            wrench: (n, 6) at the step's end, [f; tau] at Bo in Gn.
        """
        return self.from_pads(self._weights[2] * (wrench @ self.to_grip.T))

    def scatter(self, noise: Array, X_SB: RigidTransform) -> Array:
        """Returns the standard deviation of the springs' wrench (6,) at the pads.

        That of `along` in a long episode: e' = f e + b w + c w' of white noise w has
        the variance (b^2 + c^2 + 2 f b c) / (1 - f^2) times that of w.

        Args:
            noise: (6,) of the sensor's readings, [f; tau] at So in S.
            X_SB: the bolt in the sensor's frame.
        """
        forgets, of_begin, of_end = self._weights
        gain = of_begin**2 + of_end**2 + 2.0 * forgets * of_begin * of_end
        return self._noise_at_pads(noise, X_SB) * np.sqrt(gain / (1.0 - forgets**2))

    def scatter_of_growth(self, noise: Array, X_SB: RigidTransform) -> Array:
        """Returns the same if in each step only the noise of its end grows evenly.

        e' = f e + c w' of white noise w: the variance is c^2 / (1 - f^2) times its.

        Args:
            noise, X_SB: see `scatter`.
        """
        forgets, _, of_end = self._weights
        gain = of_end**2 / (1.0 - forgets**2)
        return self._noise_at_pads(noise, X_SB) * np.sqrt(gain)

    def _noise_at_pads(self, noise: Array, X_SB: RigidTransform) -> Array:
        """Returns the standard deviations of a measured wrench (6,) at the pads."""
        each = np.hstack([np.zeros((6, 6)), np.diag(noise)])
        at_pads = at_bolt(each, X_SB)[:, 6:] @ self.to_grip.T
        return np.asarray(np.linalg.norm(at_pads, axis=0))

    def rates(self, elastic: Array, wrench: Array) -> Array:
        """Returns the bolt's rates (n, 6) against the arm, in the twin's coordinates.

        Args:
            elastic: (n, 6) the springs' share of the wrench, at Bo in Gn.
            wrench: (n, 6) measured, [f; tau].
        """
        at_grip = (wrench - elastic) @ self.to_grip.T
        return np.asarray((at_grip / self.springs.damping)[:, list(AXIS_ORDER)])
