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
#: the shipped gripper and time step (`tests/physics/compliance.py`). Of rigid fingers
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
        mobility: (6, 6) rates at the pads, To, by the wrench there [f; tau], in Gn.
        sag: (6, 6) deflection by the weight that turned away, likewise.
        rest: (6,) the weight that the springs carry at the start, [f; tau] at To.
        p_BoTo_B: (3,) that point [m].
        period: of the task [s].
    """

    mobility: Array
    sag: Array
    rest: Array
    p_BoTo_B: Array
    period: float

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
        turns = station in ("cell", "hardware")
        R_GW = nominal_groove_pose(scenario.placement).rotation().inverse()
        g_W = UniformGravityFieldElement().gravity_vector()
        f = R_GW @ (carried.get_mass() * g_W)
        tau = np.cross(carried.get_com() - twin.p_BoTo_B, f)
        return cls(
            S @ np.diag(_MOBILITY * creeps) @ S.T,
            np.diag(turns / twin.grip.stiffness),
            np.concatenate([f, tau]),
            twin.p_BoTo_B,
            scenario.task.period,
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
        at_grip, turns = self.at_grip(measured, wrench), _turns(measured)
        steps = 0.5 * self.period * (at_grip[1:] + at_grip[:-1])
        total = np.vstack([np.zeros((1, 6)), np.cumsum(steps, axis=0)])
        f, tau = self.rest[:3], self.rest[3:]
        turned_away = self.rest - np.hstack([turns.apply(f), turns.apply(tau)])
        offset = total @ self.mobility.T + turned_away @ self.sag.T
        return np.asarray(offset[:, list(AXIS_ORDER)])


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
