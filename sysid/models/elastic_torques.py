"""What the torques of an arm change by where a joint's gear yields.

The encoder of an elastic joint i is on its motor's side: the link is behind it by
q - q_link = c tau_i, with c the gear's compliance (Spong 1987, "Modeling and control
of elastic joint robots"). Along the motion tau(q_link, q_link', q_link'') is then, to
first order in c,

    tau - c (dtau/dq_i tau_i + dtau/dv_i tau_i' + dtau/dvd_i tau_i''),

a derivative of inverse dynamics into the direction (tau_i, tau_i', tau_i''). tau_i is
the load by the URDF: the measured torque is too noisy to be differentiated twice.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from sysid.models.base import Array
from sysid.models.regressor import ArmDynamics

_SHIFT = 1e-4  # rad or m by which a link is moved at most for the derivative
_WINDOW = 0.1  # s in which a load is a polynomial: it follows up to some 15 Hz
_ORDER = 4  # of the polynomial
_LEAST_WINDOW = 2 * _ORDER + 1  # samples, so that the fit is overdetermined


class ElasticTorques:
    """Derivatives of an arm's torques by the joints' compliances, found when asked for.

    Each takes an evaluation of the inverse dynamics for each sample, once.

    Args:
        urdf: of the arm.
        joints: their names.
        time, episode: (n,) of the samples [s].
        motion: (3, n, joints) q, v, vd.
    """

    def __init__(
        self,
        urdf: str,
        joints: Sequence[str],
        time: Array,
        episode: NDArray[np.int64],
        motion: Array,
    ) -> None:
        self._urdf, self._joints = urdf, tuple(joints)
        self._time, self._episode, self._motion = time, episode, motion
        self._load: Array | None = None
        self._found: dict[str, Array] = {}

    def by_compliance(self, joint: str) -> Array:
        """Returns dtau/dc (n, joints) by the compliance of a joint [(N m)^2/rad]."""
        if joint not in self._found:
            self._found[joint] = self._derivative(self._joints.index(joint))
        return self._found[joint]

    def _derivative(self, i: int) -> Array:
        arm = ArmDynamics(self._urdf, self._joints)
        if self._load is None:
            self._load = arm.torques(*self._motion)
        load = self._load[:, i]
        largest = float(np.abs(load).max())
        if not largest:
            return np.zeros_like(self._load)
        compliance = _SHIFT / largest
        linked = self._motion.copy()
        linked[:, :, i] -= compliance * self._with_derivatives(load)
        return (arm.torques(*linked) - self._load) / compliance

    def _with_derivatives(self, load: Array) -> Array:
        """Returns a load (n,) with its first two derivatives in time, (3, n)."""
        found = np.zeros((3, len(load)))
        found[0] = load
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
