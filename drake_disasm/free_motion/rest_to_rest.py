"""Straight ways from rest to rest."""

import numpy as np

from drake_disasm.free_motion.arm_limits import JointLimits

#: Greatest v and vd of a way of length 1 in a time of 1.
PEAK_SPEED, PEAK_ACCELERATION = 1.875, 10.0 / np.sqrt(3.0)
#: Of a table of a motion [s].
PERIOD = 0.01

_SPEED = 0.8  # of what the limits allow


def shares(rows: int) -> np.ndarray:
    """Returns the shares (rows,) of a way that a quintic has done; the last is 1."""
    s = np.arange(1, rows + 1) / rows
    return np.asarray(s**3 * (10.0 - 15.0 * s + 6.0 * s**2))


def straight(limits: JointLimits, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Returns a straight way (n, joints) from one posture to another, in PERIODs."""
    away = np.abs(other - one) / _SPEED
    slowest = np.max(PEAK_SPEED * away / limits.velocity)
    softest = np.sqrt(np.max(PEAK_ACCELERATION * away / limits.acceleration))
    rows = max(1, int(np.ceil(max(slowest, softest) / PERIOD)))
    return np.asarray(one + shares(rows)[:, None] * (other - one))
