"""Backing away from what presses on the gripper, after a hold."""

import numpy as np

from drake_disasm.cell.coordinates import Coordinates
from drake_disasm.common.errors import DisasmError
from drake_disasm.safety.guards import Situation, devices_ready
from drake_disasm.safety.limits import SafetyConfig

#: The force [max_force] down to which it backs away.
RELIEVED = 0.5
#: A force [max_force] that no motion of one step explains: a sensor at fault, or a
#: collision; who knows where backing away would lead.
INEXPLICABLE = 2.0
#: Growth of the force, relative, that says that this is not the way out.
WORSE = 1.2


class Retreat:
    """Moves the place of a hold along the force on the bolt, until that is small.

    A hold at the measured place keeps pressing: a stiff arm that is told to stay
    where it was measured still leans on what stopped it. Along the force, slowly and
    no further than a set way, the load falls as a spring's does. It ends early where
    the force grows, or where a device is not ready.

    Attributes:
        words: how far it has come; empty if it never began.

    Args:
        coordinates: map joint angles to X_GB and back.
        R_BS: (3, 3) rotation of the sensor's axes in the bolt's.
        limits: of the station.
        period: between commands [s].
    """

    def __init__(
        self,
        coordinates: Coordinates,
        R_BS: np.ndarray,
        limits: SafetyConfig,
        period: float,
    ) -> None:
        self._coordinates, self._R_BS, self._limits = coordinates, R_BS, limits
        self._step = limits.retreat_speed * period
        self._left, self._first, self._way = 0.0, 0.0, 0.0
        self.words = ""

    def begin(self, situation: Situation) -> None:
        """Decides at the start of a hold whether to back away at all."""
        force, most = _force(situation), self._limits.max_force
        applies = most < force <= INEXPLICABLE * most  # not where it is NaN
        self._left = self._limits.retreat if applies else 0.0
        self._first, self._way, self.words = force, 0.0, ""

    def advance(self, q_held: np.ndarray, situation: Situation) -> np.ndarray:
        """Returns the next place to hold at (7,) [rad]; the same once it has ended."""
        if self._left <= 0.0:
            return q_held
        if self._way:
            force = _force(situation)
            self.words = f"; backed away {1e3 * self._way:.2f} mm, to {force:.1f} N"
        if self._is_over(situation):
            self._left = 0.0
            return q_held
        X_GB = self._coordinates.pose(q_held)
        assert situation.load is not None
        f_G = situation.X_GB.rotation().matrix() @ self._R_BS @ situation.load[:3]
        step = min(self._step, self._left)
        X_GB.set_translation(X_GB.translation() + step * f_G / np.linalg.norm(f_G))
        try:
            q = self._coordinates.solve(X_GB, q_held)
        except DisasmError:  # out of reach
            self._left = 0.0
            return q_held
        self._left -= step
        self._way += step
        return q

    def _is_over(self, situation: Situation) -> bool:
        if devices_ready(situation, self._limits):
            return True
        force = _force(situation)
        going_on = RELIEVED * self._limits.max_force < force <= WORSE * self._first
        return not going_on  # so too where it is NaN


def _force(situation: Situation) -> float:
    """Returns the force on the bolt [N]; NaN while the sensor is not zeroed."""
    if situation.load is None:
        return float(np.nan)
    return float(np.linalg.norm(situation.load[:3]))
