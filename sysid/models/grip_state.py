"""Where the bolt is in the grip as a step begins, which no encoder measures."""

import dataclasses
import functools
from typing import Self

import numpy as np
from pydrake.multibody.tree import UniformGravityFieldElement
from scipy.spatial.transform import Rotation

from drake_disasm.cell.grip import AXIS_ORDER, JOINT_OF_AXIS, Springs
from drake_disasm.cell.placement import nominal_groove_pose
from drake_disasm.cell.tool import Tool
from drake_disasm.cell.twin_parameters import twin_of
from drake_disasm.common.rotations import matrices_of_turns
from drake_disasm.common.spatial import velocity_shift
from drake_disasm.scenario import Scenario
from drake_disasm.systems.observation import Mounting
from sysid.models.base import Array
from sysid.models.commands import bolt_path
from sysid.models.sensor_reading import at_bolt

_FORGOTTEN = 0.1  # of a step: with less, e^-10 of what was before is left

#: Rates of the bolt in the simulated pads by a load on it, along and about x, y and z
#: of Gn [m/(N s), rad/(N m s)], in a point on the bolt about which it turns: Drake
#: regularises friction in proportion to the lightest body. Measured in the cell with
#: the shipped gripper and time step (`benchmarks/compliance.py`). Of rigid fingers
#: it is two thirds, but micrometres decide there: logs are predicted worse with it.
_MOBILITY = np.array([2.1e-6, 1.3e-6, 0.0, 0.0, 0.0, 20.5e-3])
_PATCH = np.array([0.0, 0.0205, 0.0])  # m, that point, p_BoPo_B


@dataclasses.dataclass(frozen=True)
class GripState:
    """How far the grip gives and the bolt has crept in it, by the measured wrench.

    The grip is a spring and a damper in parallel (Kelvin and Voigt): w = k d + c d', so
    that the deflection d follows w / k with a lag of c / k, 0.06 s for the grip that
    yields. A bolt that has just run into a stop loads its sensor by the dampers alone:
    springs that carried all of it would have the bolt a step's travel behind. Between
    two steps the wrench is taken for linear in time. A stiff grip has forgotten what
    was at the begin; when in the step a force came, nobody knows, and the springs carry
    all of it.

    In the cell the bolt is elsewhere, besides, for what the twin does not have. It
    creeps in the pads (d' = C w, a damper in series, Maxwell). And the springs carry
    its weight w_0 as it was before the arm turned by R: then they give by
    (w_0 - R w_0) / k, while the twin's springs do not turn. For the twin the arm stands
    elsewhere by as much.

    Attributes:
        springs: of the grip, at the pads, To, in Gn.
        rest: (6,) the weight that they carry at the start, [f; tau] at To in Gn.
        mobility: (6, 6) rates at the pads by the wrench there [f; tau], along and about
            the axes of the bolt as gripped, which turn with the arm.
        p_BoTo_B: (3,) where the pads are [m].
        period: of the task [s].
        turns: whether the springs turn with the arm; a twin's do not.
    """

    springs: Springs
    rest: Array
    mobility: Array
    p_BoTo_B: Array
    period: float
    turns: bool

    @classmethod
    def of(cls, scenario: Scenario, station: str = "twin") -> Self:
        """Returns the grip of a station's logs.

        Args:
            scenario: of the log.
            station: "cell", "hardware", "twin", or whatever the log says; creep was
                measured in the cell alone.
        """
        gripper, twin = scenario.gripper, twin_of(scenario)
        carried = Tool.from_models(scenario).M_gripped_B
        creeps = station == "cell" and gripper.hold == "friction"
        creeps &= bool(gripper.fingers) and gripper.compliance == "adaptive"
        S = velocity_shift(_PATCH - twin.p_BoTo_B)
        R_GW = nominal_groove_pose(scenario.placement).rotation().inverse()
        f = R_GW @ (carried.get_mass() * UniformGravityFieldElement().gravity_vector())
        return cls(
            twin.grip,
            np.concatenate([f, np.cross(carried.get_com() - twin.p_BoTo_B, f)]),
            S @ np.diag(_MOBILITY * creeps) @ S.T,
            twin.p_BoTo_B,
            scenario.task.period,
            station in ("cell", "hardware"),
        )

    # How far the grip gives. Wrenches are [f; tau] on the bolt at Bo in Gn.

    @functools.cached_property
    def to_grip(self) -> Array:
        """Wrench at the pads by that on the bolt at Bo (6, 6)."""
        return np.asarray(velocity_shift(self.p_BoTo_B).T)

    def from_pads(self, at_grip: Array) -> Array:
        """Returns wrenches (n, 6) at Bo, of those at the pads."""
        return np.asarray(np.linalg.solve(self.to_grip, at_grip.T).T)

    def elastic(self, wrench: Array) -> Array:
        """Returns what the springs carry (n, 6) of a wrench (n, 6) along an episode."""
        if not self._lags:
            return wrench
        forgets, of_begin, of_end = self._weights
        found = wrench @ self.to_grip.T
        found[1:] = of_begin * found[:-1] + of_end * found[1:]
        for k in range(1, len(found)):
            found[k] += forgets * found[k - 1]
        return self.from_pads(found)

    def after(self, elastic: Array, wrench: Array) -> Array:
        """Returns what they carry (n, 6) at the end of steps of several episodes.

        Args:
            elastic: (n, 6) what they carried at the begin.
            wrench: (n, 2, 6) measured at begin and end.
        """
        if not self._lags:
            return wrench[:, 1]
        parts = np.stack([elastic, wrench[:, 0], wrench[:, 1]], axis=1) @ self.to_grip.T
        return self.from_pads(np.sum(self._weights * parts, axis=1))

    @property
    def _lags(self) -> bool:
        """Whether springs are slow enough for a step's begin to matter at its end."""
        lag = self.springs.damping / self.springs.stiffness
        return bool(lag.max() > _FORGOTTEN * self.period)

    @functools.cached_property
    def _weights(self) -> Array:
        """Of the springs' wrench and the measured one at begin and end (3, 6)."""
        lag = self.springs.damping / self.springs.stiffness
        forgets = np.exp(-self.period / lag)
        of_begin = lag / self.period * (1.0 - forgets) - forgets
        return np.array([forgets, of_begin, 1.0 - forgets - of_begin])

    def rates(self, elastic: Array, wrench: Array) -> Array:
        """Returns the bolt's rates (n, 6) against the arm, in the twin's coordinates.

        Args:
            elastic: (n, 6) the springs' share of the wrench.
            wrench: (n, 6) measured.
        """
        at_grip = (wrench - elastic) @ self.to_grip.T
        return np.asarray((at_grip / self.springs.damping)[:, list(AXIS_ORDER)])

    def deflections(self, wrench: Array) -> Array:
        """Returns by how much the grip gives at rest (n, 6) under a wrench [m, rad]."""
        return np.asarray(wrench @ self.to_grip.T / self.springs.stiffness)

    def carried(self, give: Array) -> Array:
        """Returns the springs' wrench (n, 6) where the grip has given way.

        The inverse of `drake_disasm.cell.grip.deflection`.

        Args:
            give: (n, 6) in the twin's coordinates.
        """
        given = give[:, list(JOINT_OF_AXIS)]
        at_grip = given * self.springs.stiffness
        at_grip[:, 3:] += np.cross(given[:, :3], at_grip[:, :3] + self.rest[:3])
        return self.from_pads(at_grip)

    def after_growth(self, wrench: Array) -> Array:
        """Returns the springs' share (n, 6) of a wrench that grew evenly in a step.

        Args:
            wrench: (n, 6) at the step's end.
        """
        return self.from_pads(self._weights[2] * (wrench @ self.to_grip.T))

    def scatter(self, noise: Array, mounting: Mounting, of_growth: bool) -> Array:
        """Returns the standard deviation of the springs' wrench (6,) at the pads.

        That of `elastic` in a long episode: e' = f e + b w + c w' of white noise w has
        the variance (b^2 + c^2 + 2 f b c) / (1 - f^2) times that of w.

        Args:
            noise: (6,) of the sensor's readings, [f; tau] at So in S.
            mounting: of the sensor.
            of_growth: whether the noise of its end alone grows evenly in each step.
        """
        forgets, of_begin, of_end = self._weights
        of_begin = 0.0 if of_growth else of_begin
        gain = of_begin**2 + of_end**2 + 2.0 * forgets * of_begin * of_end
        each = np.hstack([np.zeros((6, 6)), np.diag(noise)])
        at_pads = at_bolt(each, mounting)[:, 6:] @ self.to_grip.T
        sigma = np.linalg.norm(at_pads, axis=0)
        return np.asarray(sigma * np.sqrt(gain / (1.0 - forgets**2)))

    # Where the bolt is, besides.

    def elsewhere(self, measured: Array, wrench: Array) -> Array:
        """Returns by how much (n, 6) it is elsewhere along a whole episode.

        Args:
            measured: (n, 6) the twin's coordinates.
            wrench: (n, 6) measured.
        """
        if not self.turns:
            return np.zeros_like(wrench)
        turns = _turns(measured)
        turned_away = self.rest - _turned(turns, self.rest)
        found = turned_away / self.springs.stiffness
        load = _turned(turns.inv(), wrench @ self.to_grip.T)
        rates = load @ self.mobility.T
        steps = 0.5 * self.period * (rates[1:] + rates[:-1])
        crept = np.vstack([np.zeros((1, 6)), np.cumsum(steps, axis=0)])
        return np.asarray((found + _turned(turns, crept))[:, list(AXIS_ORDER)])


def of_encoders(states: Array, q: Array, elsewhere: Array, p_BoTo_B: Array) -> Array:
    """Returns states (n, 12) as encoders have them, of a twin that stands elsewhere.

    The wrench is at Bo in Gn: the lever to Bo, as encoders have it, is another.

    Args:
        states: of the twin, wrench included.
        q: (n, 6) coordinates near them.
        elsewhere: (n, 6) by how much the twin is, in coordinates.
        p_BoTo_B: (3,) see `BoltCoordinates`.
    """
    moved = bolt_path(q + elsewhere, p_BoTo_B) - bolt_path(q, p_BoTo_B)
    found = states.copy()
    found[:, :6] -= moved
    found[:, 9:] += np.cross(moved[:, :3], states[:, 6:9])
    return found


def _turns(coordinates: Array) -> Rotation:
    """Returns the rotations of coordinates (n, 6)."""
    return Rotation.from_matrix(matrices_of_turns(coordinates[:, 3:]))


def _turned(turns: Rotation, vectors: Array) -> Array:
    """Returns pairs of vectors (6,) or (n, 6) that are turned by n rotations."""
    parts = [turns.apply(part) for part in np.split(vectors, 2, axis=-1)]
    return np.hstack(parts)
