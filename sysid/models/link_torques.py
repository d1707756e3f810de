"""What the torques of an arm change by where a link is not where its encoder says.

If the link of joint i is behind the encoder's reading by d, its velocity by d' and its
acceleration by d'', the torques by what was read are, to first order,

    tau - (dtau/dq_i d + dtau/dv_i d' + dtau/dvd_i d''),

a derivative of inverse dynamics into the direction (d, d', d'').

The encoder of an elastic joint is on its motor's side: d = c tau_i, with c the gear's
compliance (Spong 1987, "Modeling and control of elastic joint robots"). tau_i is the
load by the URDF: the measured torque is too noisy to be differentiated twice. Of an
encoder that reads (1 + s) q + o, it is d = o + s q.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from sysid.models.base import Array
from sysid.models.regressor import ArmRegressor

_SHIFT = 1e-4  # rad or m by which a link is moved at most for the derivative
_WINDOW = 0.1  # s in which a load is a polynomial: it follows up to some 15 Hz
_ORDER = 4  # of the polynomial
_LEAST_WINDOW = 2 * _ORDER + 1  # samples, so that the fit is overdetermined


class LinkTorques:
    """Derivatives of an arm's torques by where links are, computed when asked for.

    Each takes an evaluation of the inverse dynamics for each sample that is asked for,
    once.

    Args:
        urdf: of the arm.
        joints: their names.
        time, episode: (n,) of the samples [s].
        motion: (3, n, joints) q, v, vd.
        gravity, inertia: of the arm, see ArmRegressor.
    """

    def __init__(
        self,
        urdf: str,
        joints: Sequence[str],
        time: Array,
        episode: NDArray[np.int64],
        motion: Array,
        gravity: Sequence[float] | None = None,
        inertia: Array | None = None,
    ) -> None:
        self._arm = urdf, tuple(joints), gravity, inertia
        self._joints = tuple(joints)
        self._time, self._episode, self._motion = time, episode, motion
        self._load = np.full(motion.shape[1:], np.nan)
        self._known: dict[tuple[str, str], Array] = {}

    def by_compliance(self, joint: str, rows: NDArray[np.int64]) -> Array:
        """Returns dtau/dc (rows, joints) by the compliance of a joint [(N m)^2/rad]."""
        return self._by("compliance", joint, rows)

    def by_offset(self, joint: str, rows: NDArray[np.int64]) -> Array:
        """Returns dtau/do (rows, joints) by the offset of an encoder [N m/rad]."""
        return self._by("offset", joint, rows)

    def by_scale(self, joint: str, rows: NDArray[np.int64]) -> Array:
        """Returns dtau/ds (rows, joints) by the scale of an encoder [N m]."""
        return self._by("scale", joint, rows)

    def _by(self, cause: str, joint: str, rows: NDArray[np.int64]) -> Array:
        known = self._known.setdefault((cause, joint), np.full_like(self._load, np.nan))
        asked = rows[np.isnan(known[rows, 0])]
        if len(asked):
            i = self._joints.index(joint)
            known[asked] = self._derivative(i, self._behind(cause, i), asked)
        return known[rows]

    def _behind(self, cause: str, i: int) -> Array:
        """Returns how far a link is behind its encoder for a cause of one: (3, n)."""
        if cause == "compliance":
            every = np.arange(len(self._time))
            return self._with_derivatives(self._loads(every)[:, i])
        if cause == "scale":
            return self._motion[:, :, i]
        return np.stack([np.ones(len(self._time)), *np.zeros((2, len(self._time)))])

    def _derivative(self, i: int, behind: Array, rows: NDArray[np.int64]) -> Array:
        """Returns how torques change (rows, joints) if the link of a joint is behind.

        Args:
            i: number of the joint.
            behind: (3, n) by how much, at all samples.
            rows: of the samples that are asked for.
        """
        largest = float(np.abs(behind[0]).max())
        if not largest:
            return np.zeros((len(rows), len(self._joints)))
        step = _SHIFT / largest
        linked = self._motion[:, rows].copy()
        linked[:, :, i] -= step * behind[:, rows]
        arm = ArmRegressor(*self._arm)
        return (arm.torques(*linked) - self._loads(rows)) / step

    def _loads(self, rows: NDArray[np.int64]) -> Array:
        """Returns the torques (rows, joints) by the URDF."""
        asked = rows[np.isnan(self._load[rows, 0])]
        if len(asked):
            arm = ArmRegressor(*self._arm)
            self._load[asked] = arm.torques(*self._motion[:, asked])
        return self._load[rows]

    def _with_derivatives(self, load: Array) -> Array:
        """Returns a load (n,) with its first two derivatives in time, (3, n).

        Of an arm at rest these are zero: it is read in one pose after the other.
        """
        found = np.zeros((3, len(load)))
        found[0] = load
        if not self._motion[1:].any():
            return found
        for number in np.unique(self._episode):
            own = self._episode == number
            found[1:, own] = time_derivatives(self._time[own], load[own])
        return found


def time_derivatives(time: Array, values: Array) -> Array:
    """Returns the first two derivatives (2, n) of values (n,) at times (n,) [s].

    By the filter of Savitzky and Golay (1964), which takes samples as evenly spaced.
    Zero where there are too few to fit a polynomial to.
    """
    rows = len(values)
    if rows < _LEAST_WINDOW:
        return np.zeros((2, rows))
    step = float(np.median(np.diff(time)))
    window = max(_LEAST_WINDOW, 2 * round(0.5 * _WINDOW / step) + 1)
    window = min(window, rows - 1 + rows % 2)  # odd, and within the episode
    return np.array([savgol_filter(values, window, _ORDER, k, step) for k in (1, 2)])
