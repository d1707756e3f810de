"""How far a heavy tail reaches."""

import numpy as np

from sysid.models.base import Array


def tail_limit(r: Array, alpha: float) -> tuple[float, float]:
    """Returns what the largest of a residual (n,) exceeds with a probability of alpha.

    And what nine of ten rows are below; both 0 for so few rows that they have no tail.
    The tail of the largest tenth is taken to fall off as a power, estimated from all
    but the largest hundredth (Hill 1975), which may be outliers themselves.
    """
    size = np.sort(np.abs(r))[::-1]
    tail, few = len(r) // 10, max(1, len(r) // 100)
    if tail <= 2 * few or size[tail] <= 0.0:
        return 0.0, 0.0
    logs = np.log(size[few:tail] / size[tail])
    index = (logs.sum() + few * logs[0]) / (tail - few)
    return float(size[tail] * (tail / alpha) ** index), float(size[tail])
