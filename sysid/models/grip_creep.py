"""How a bolt creeps in the cell's pads under a steady load, unseen by encoders."""

import dataclasses
from typing import Self

import numpy as np

from drake_disasm.cell.grip import AXIS_ORDER
from drake_disasm.cell.twin_parameters import twin_of
from drake_disasm.common.spatial import velocity_shift
from drake_disasm.scenario import Scenario
from sysid.models.base import Array
from sysid.models.commands import bolt_path

#: Rates of the bolt in the simulated pads by a load on it, along and about x, y and z
#: of Gn [m/(N s), rad/(N m s)], in a point on the bolt about which it turns: Drake
#: regularises friction in proportion to the lightest body. Measured in the cell with
#: the shipped gripper and time step (`tests/physics/compliance.py`).
_MOBILITY = {
    "adaptive": np.array([2.1e-6, 1.3e-6, 0.0, 0.0, 0.0, 20.5e-3]),
    "rigid": np.array([1.0e-6, 0.9e-6, 0.0, 0.0, 0.0, 13.1e-3]),
}
_PATCH = np.array([0.0, 0.0205, 0.0])  # m, that point, p_BoPo_B


@dataclasses.dataclass(frozen=True)
class GripCreep:
    """How far the bolt has crept in the pads, by all wrenches since an episode began.

    A damper in series with the grip's spring (Maxwell): d' = C w. For the twin, which
    has no such damper, the arm stands elsewhere by as much.

    Attributes:
        mobility: (6, 6) rates at the pads, To, by the wrench there [f; tau], in Gn.
        p_BoTo_B: (3,) that point [m].
        period: of the task [s].
    """

    mobility: Array
    p_BoTo_B: Array
    period: float

    @classmethod
    def of(cls, scenario: Scenario, station: str) -> Self:
        """Returns the creep in logs of a station; none where it was not measured.

        Args:
            scenario: of the log.
            station: "cell", "hardware", "twin", or whatever the log says.
        """
        gripper, p_BoTo_B = scenario.gripper, twin_of(scenario).p_BoTo_B
        creeps = station == "cell" and gripper.hold == "friction"
        S = velocity_shift(_PATCH - p_BoTo_B)
        mobility = S @ np.diag(_MOBILITY[gripper.compliance] * creeps) @ S.T
        return cls(mobility, p_BoTo_B, scenario.task.period)

    def along(self, wrench: Array) -> Array:
        """Returns how far the bolt has crept (n, 6), in the twin's coordinates.

        Args:
            wrench: (n, 6) on the bolt at Bo in Gn, [f; tau], of a whole episode.
        """
        at_grip = wrench @ velocity_shift(self.p_BoTo_B)
        steps = 0.5 * self.period * (at_grip[1:] + at_grip[:-1])
        total = np.vstack([np.zeros((1, 6)), np.cumsum(steps, axis=0)])
        return (total @ self.mobility.T)[:, list(AXIS_ORDER)]


def of_encoders(states: Array, q: Array, crept: Array, p_BoTo_B: Array) -> Array:
    """Returns states (n, 12) as encoders have them, of a twin that stands elsewhere.

    The wrench is at Bo in Gn: the lever to Bo, as encoders have it, is another.

    Args:
        states: of the twin, wrench included.
        q: (n, 6) coordinates near them.
        crept: (n, 6) by how much the twin stands elsewhere, in coordinates.
        p_BoTo_B: (3,) see `BoltCoordinates`.
    """
    moved = bolt_path(q + crept, p_BoTo_B) - bolt_path(q, p_BoTo_B)
    found = states.copy()
    found[:, :6] -= moved
    found[:, 9:] += np.cross(moved[:, :3], states[:, 6:9])
    return found
