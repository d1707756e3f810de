"""What the benchmark of stalls makes of commands on the wire."""

import numpy as np
import pytest
from stalls import StallRun, measure, table_rows

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


def test_the_table_shows_the_worst_of_each() -> None:
    runs = [
        StallRun("policy", 0.1, 21, 0.0045, 0.03, 1.5, 0.11, "went on"),
        StallRun("policy", 0.1, 20, 0.0046, 0.04, 1.0, 0.13, "went on"),
    ]
    assert table_rows(runs) == [(0.1, "policy", 21, 4.5, 40.0, 1.5, 0.12, "2 went on")]
