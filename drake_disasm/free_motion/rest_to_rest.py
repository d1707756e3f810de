"""Straight ways from rest to rest."""

import numpy as np

#: Greatest v and vd of a way of length 1 in a time of 1.
PEAK_SPEED, PEAK_ACCELERATION = 1.875, 10.0 / np.sqrt(3.0)


def shares(rows: int) -> np.ndarray:
    """Returns the shares (rows,) of a way that a quintic has done; the last is 1."""
    s = np.arange(1, rows + 1) / rows
    return np.asarray(s**3 * (10.0 - 15.0 * s + 6.0 * s**2))
