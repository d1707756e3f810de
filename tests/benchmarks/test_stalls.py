"""What the benchmark of stalls makes of commands on the wire."""

import numpy as np
import pytest
from stalls import measure

PERIOD = 0.005  # s


def test_haste_is_seen() -> None:
    """Forty commands at their rate, then twenty within 20 ms."""
    times = np.concatenate([PERIOD * np.arange(40), 0.5 + 0.001 * np.arange(20)])
    q = np.outer(np.arange(60), np.full(7, 1.5e-4))
    rate, gap, speed = measure((times, q), PERIOD)
    assert (rate, gap) == (20, pytest.approx(0.001))
    assert speed == pytest.approx(0.15)
    rate, gap, speed = measure((times[:40], q[:40]), PERIOD)
    assert gap == pytest.approx(PERIOD) and speed == pytest.approx(0.03)
