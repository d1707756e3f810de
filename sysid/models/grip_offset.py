"""Where a bolt is in the grip, beyond what the springs say; no encoder measures it."""

import dataclasses
from typing import Self

import numpy as np
from pydrake.multibody.tree import UniformGravityFieldElement
from scipy.spatial.transform import Rotation

from drake_disasm.cell.grip import AXIS_ORDER
from drake_disasm.cell.placement import nominal_groove_pose
from drake_disasm.cell.tool import Tool
from drake_disasm.cell.twin_parameters import twin_of
from drake_disasm.common.spatial import velocity_shift
from drake_disasm.scenario import Scenario
from sysid.models.base import Array
from sysid.models.commands import bolt_path

#: Rates of the bolt in the simulated pads by a load on it, along and about x, y and z
#: of Gn [m/(N s), rad/(N m s)], in a point on the bolt about which it turns: Drake
#: regularises friction in proportion to the lightest body. Measured in the cell with
#: the shipped gripper and time step (`benchmarks/compliance.py`). Of rigid fingers
#: it is two thirds, but micrometres decide there: logs are predicted worse with it.
_MOBILITY = np.array([2.1e-6, 1.3e-6, 0.0, 0.0, 0.0, 20.5e-3])
_PATCH = np.array([0.0, 0.0205, 0.0])  # m, that point, p_BoPo_B


@dataclasses.dataclass(frozen=True)
class GripOffset:
    """By how much a bolt is elsewhere in the grip than the twin's would be.

    It creeps in the pads (d' = C w, a damper in series with the springs, Maxwell). And
    the springs carry its weight w_0 as it was before the arm turned by R: then they
    give by (w_0 - R w_0) / k, while the twin's springs do not turn. For the twin, which
    has neither, the arm stands elsewhere by as much.

    Attributes:
        mobility: (6, 6) rates at the pads, To, by the wrench there [f; tau], along and
            about the axes of the bolt as gripped, which turn with the arm.
        compliance: (6,) of the springs, likewise.
        rest: (6,) the weight that the springs carry at the start, [f; tau] at To in Gn.
        p_BoTo_B: (3,) that point [m].
        period: of the task [s].
        turns: whether the springs turn with the arm; a twin's do not.
    """

    mobility: Array
    compliance: Array
    rest: Array
    p_BoTo_B: Array
    period: float
    turns: bool

    @classmethod
    def of(cls, scenario: Scenario, station: str) -> Self:
        """Returns the offset in logs of a station.

        Args:
            scenario: of the log.
            station: "cell", "hardware", "twin", or whatever the log says; creep was
                measured in the cell alone.
        """
        gripper, twin = scenario.gripper, twin_of(scenario)
        carried = Tool.from_models(scenario).M_gripped_B
        creeps = station == "cell" and gripper.hold == "friction"
        creeps &= gripper.compliance == "adaptive"
        S = velocity_shift(_PATCH - twin.p_BoTo_B)
        R_GW = nominal_groove_pose(scenario.placement).rotation().inverse()
        g_W = UniformGravityFieldElement().gravity_vector()
        f = R_GW @ (carried.get_mass() * g_W)
        tau = np.cross(carried.get_com() - twin.p_BoTo_B, f)
        return cls(
            S @ np.diag(_MOBILITY * creeps) @ S.T,
            1.0 / twin.grip.stiffness,
            np.concatenate([f, tau]),
            twin.p_BoTo_B,
            scenario.task.period,
            station in ("cell", "hardware"),
        )

    def at_grip(self, measured: Array, wrench: Array) -> Array:
        """Returns wrenches (n, 6) at the pads, To, in Gn.

        The lever from Bo turns with the arm.

        Args:
            measured: (n, 6) the twin's coordinates.
            wrench: (n, 6) on the bolt at Bo in Gn, [f; tau].
        """
        lever = _turns(measured).apply(np.array(self.p_BoTo_B))
        t = wrench[:, 3:] - np.cross(lever, wrench[:, :3])
        return np.hstack([wrench[:, :3], t])

    def along(self, measured: Array, wrench: Array) -> Array:
        """Returns the offset (n, 6) along a whole episode, in the twin's coordinates.

        Args:
            measured, wrench: see `at_grip`.
        """
        offset = self._crept(measured, wrench)
        offset += self._turned_away(measured) * self.compliance
        return np.asarray(offset[:, list(AXIS_ORDER)])

    def moved_moment(self, measured: Array, wrench: Array) -> Array:
        """Returns the moment (n, 3) at To of a load that the springs have moved, in Gn.

        The arm carries it besides what the springs do, which act where they have given
        way to. In the twin it does not.

        Args:
            measured, wrench: see `at_grip`.
        """
        if not self.turns:
            return np.zeros((len(measured), 3))
        f = wrench[:, :3]
        moved = (f + self._turned_away(measured)[:, :3]) * self.compliance[:3]
        return np.cross(moved, f + self.rest[:3])

    def _turned_away(self, measured: Array) -> Array:
        """Returns the weight (n, 6) that springs would carry had they not turned."""
        if not self.turns:
            return np.zeros((len(measured), 6))
        return self.rest - _turned(_turns(measured), self.rest)

    def _crept(self, measured: Array, wrench: Array) -> Array:
        """Returns how far (n, 6) the bolt has crept in the pads, at To in Gn."""
        if not self.mobility.any():
            return np.zeros_like(wrench)
        turns, load = _turns(measured), self.at_grip(measured, wrench)
        load[:, 3:] -= self.moved_moment(measured, wrench)
        rates = _turned(turns.inv(), load) @ self.mobility.T
        steps = 0.5 * self.period * (rates[1:] + rates[:-1])
        return _turned(turns, np.vstack([np.zeros((1, 6)), np.cumsum(steps, axis=0)]))


def of_encoders(states: Array, q: Array, offset: Array, p_BoTo_B: Array) -> Array:
    """Returns states (n, 12) as encoders have them, of a twin that stands elsewhere.

    The wrench is at Bo in Gn: the lever to Bo, as encoders have it, is another.

    Args:
        states: of the twin, wrench included.
        q: (n, 6) coordinates near them.
        offset: (n, 6) by how much the twin stands elsewhere, in coordinates.
        p_BoTo_B: (3,) see `BoltCoordinates`.
    """
    moved = bolt_path(q + offset, p_BoTo_B) - bolt_path(q, p_BoTo_B)
    found = states.copy()
    found[:, :6] -= moved
    found[:, 9:] += np.cross(moved[:, :3], states[:, 6:9])
    return found


def _turns(coordinates: Array) -> Rotation:
    """Returns the rotations of coordinates (n, 6)."""
    return Rotation.from_euler("ZYX", coordinates[:, 3:])


def _turned(turns: Rotation, vectors: Array) -> Array:
    """Returns pairs of vectors (6,) or (n, 6) that are turned by n rotations."""
    parts = [turns.apply(part) for part in np.split(vectors, 2, axis=-1)]
    return np.hstack(parts)
