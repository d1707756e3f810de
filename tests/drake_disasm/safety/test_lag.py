"""How far a diagram is behind of late, and who is slow."""

import pytest

from drake_disasm.common.stopwatch import Stopwatch
from drake_disasm.safety import LagMonitor


def test_shares_are_of_the_diagrams_own_time() -> None:
    """Each period of 0.1 s the policy takes 0.15 s, and 0.15 s slip."""
    policy, now, slipped = Stopwatch(), 0.0, 0.0
    monitor = LagMonitor(2.0)
    monitor.stopwatches["policy"] = policy
    lag = monitor.update(now, slipped, 0.0)
    assert lag.slipped == 0.0
    for _ in range(40):
        now, slipped = now + 0.25, slipped + 0.15
        policy.total += 0.15
        lag = monitor.update(now, slipped, waited=now - slipped)
    assert lag.window == pytest.approx(2.0, abs=0.3)
    assert lag.slipped == pytest.approx(0.6 * lag.window)
    assert lag.shares["policy"] == pytest.approx(1.5)
    assert lag.shares_in_words.startswith("policy 150 %")
    assert lag.slowest == ("policy", pytest.approx(0.15))
    monitor.begin()
    assert monitor.update(now, slipped, 0.0).slipped == 0.0


def test_a_stopwatch_adds_up_by_its_own_clock() -> None:
    times = iter([1.0, 1.5, 7.0, 7.25])
    watch = Stopwatch()
    watch.clock = lambda: next(times)
    for _ in range(2):
        with watch:
            pass
    assert watch.total == 0.75
