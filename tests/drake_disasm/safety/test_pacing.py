"""Commands keep their pace, whatever stalls, and it is known who is slow."""

import numpy as np
import pytest

from drake_disasm.common.stopwatch import Stopwatch
from drake_disasm.safety import LagMonitor, Pace

PERIOD = 0.005  # s


class Time:
    """A clock that moves when it is waited for, or when something stalls."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now

    def wait(self, duration: float) -> None:
        self.now += duration


def _nothing() -> None:
    """Sends nothing, in no time."""


def paced(stalls: dict[int, float], where: str, n: int = 200) -> tuple:
    """When commands left (m,), and the pace; stalls [s] by the command's number."""
    time = Time()
    pace = Pace(PERIOD, time, time.wait, look=3 * PERIOD)
    sent = []
    for number in range(n):
        time.now += 0.0003  # what a diagram takes
        if where == "before":
            time.now += stalls.get(number, 0.0)
        pace.await_turn()
        time.now += 0.0007
        if where == "sending":
            time.now += stalls.get(number, 0.0)
        if pace.is_late():
            pace.skip()
        else:
            pace.leave(lambda: sent.append(time.now))
    return np.array(sent), pace


def test_without_stalls_it_keeps_the_period_and_loses_nothing() -> None:
    """Jitter is made up for by gaps that are a little shorter."""
    sent, pace = paced({}, "before")
    assert np.diff(sent)[1:] == pytest.approx(PERIOD, abs=1e-9)
    assert pace.counts.slipped == 0.0 and pace.counts.stalls == 0
    sent, pace = paced({20: 0.006, 40: 0.007, 41: 0.002}, "before")
    assert np.diff(sent).min() >= 0.9 * PERIOD - 1e-6
    assert sent[-1] - sent[0] == pytest.approx(199 * PERIOD, abs=1e-3)
    assert pace.counts.slipped == 0.0


@pytest.mark.parametrize("stall", [0.02, 3.0])
@pytest.mark.parametrize("where", ["before", "sending"])
def test_lost_time_stays_lost(stall: float, where: str) -> None:
    sent, pace = paced({50: stall}, where)
    assert np.diff(sent).min() >= 0.9 * PERIOD - 1e-6
    windows = np.searchsorted(sent, sent + 0.1) - np.arange(len(sent))
    assert windows.max() <= 1.2 * 0.1 / PERIOD
    counts = pace.counts
    assert counts.stalls == 1 and counts.held == (where == "sending")
    assert counts.slipped == pytest.approx(stall + 3 * PERIOD, abs=1.5 * PERIOD)
    assert counts.longest_stall == pytest.approx(stall, abs=1.1 * PERIOD)


def test_a_stall_is_told_of_once_at_the_next_turn() -> None:
    time = Time()
    pace = Pace(PERIOD, time, time.wait)
    overdue = []
    for number in range(6):
        time.now += 0.3 if number == 3 else 0.0
        overdue.append(pace.await_turn().overdue)
        pace.leave(_nothing)
    assert overdue == [0.0, 0.0, 0.0, pytest.approx(0.295), 0.0, 0.0]
    stalls = [0.5]  # while it waits

    def wait(duration: float) -> None:
        time.now += duration + (stalls.pop() if stalls else 0.0)

    pace = Pace(PERIOD, time, wait)
    pace.await_turn()
    pace.leave(_nothing)
    assert pace.await_turn().overdue == pytest.approx(0.496, abs=5e-3)


def test_the_step_that_a_command_may_lead_is_of_the_time_since_the_last() -> None:
    time = Time()
    pace = Pace(PERIOD, time, time.wait)
    assert pace.await_turn().since_sent == PERIOD  # the first
    pace.leave(_nothing)
    assert pace.await_turn().since_sent == pytest.approx(PERIOD)
    time.now += 0.7 * PERIOD  # it leaves late: the next one's turn comes soon after
    pace.leave(_nothing)
    assert pace.await_turn().since_sent == pytest.approx(0.9 * PERIOD)
    pace.leave(_nothing)
    time.now += 3.0
    assert pace.await_turn().since_sent == PERIOD


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
    times = iter([1.0, 1.5, 7.0, 7.25])
    policy.clock, before = lambda: next(times), policy.total
    for _ in range(2):
        with policy:
            pass
    assert policy.total == pytest.approx(before + 0.75)
