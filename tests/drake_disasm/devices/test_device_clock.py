"""Samples keep their own time, however late they come."""

import socket
import time

import numpy as np
import pytest

from drake_disasm.devices.datagrams import receive, stamp_arrivals
from drake_disasm.devices.device_clock import DRIFT, DeviceClock


def _taken_at(clock: DeviceClock, taken: np.ndarray, at: np.ndarray) -> np.ndarray:
    return np.array([clock.taken_at(*pair) for pair in zip(taken, at, strict=True)])


def test_a_burst_of_queued_samples_keeps_the_times_at_which_they_were_taken() -> None:
    clock, taken = DeviceClock(), np.arange(40) * 0.01
    arrivals = 1000.0 + taken + 0.002
    arrivals[20:32] = arrivals[32]  # a stall of 0.12 s, then all at once
    found = _taken_at(clock, taken, arrivals)
    assert found == pytest.approx(1000.002 + taken, abs=DRIFT * 0.14)
    assert (arrivals - found).max() == pytest.approx(0.12, abs=2e-3)


def test_jitter_never_makes_a_sample_younger_than_its_arrival() -> None:
    rng = np.random.default_rng(0)
    clock, taken = DeviceClock(), np.arange(5000) * 0.005
    arrivals = 7.0 + taken + rng.exponential(0.001, len(taken))
    found = _taken_at(clock, taken, arrivals)
    assert (found <= arrivals + 1e-12).all()
    assert np.abs(found - 7.0 - taken)[50:].max() < 1e-3


@pytest.mark.parametrize("rate", [1.0 - 2e-4, 1.0 + 2e-4])
def test_a_clock_that_drifts_is_followed(rate: float) -> None:
    clock, true = DeviceClock(), np.arange(100_000) * 0.01
    ages = [now - clock.taken_at(rate * now, now) for now in true]
    assert max(ages) < 1e-3


def test_the_operating_system_knows_when_a_datagram_came() -> None:
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ours,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as theirs,
    ):
        ours.bind(("127.0.0.1", 0))
        ours.settimeout(10.0)
        stamp_arrivals(ours)
        before = time.monotonic()
        theirs.sendto(b"sample", ours.getsockname())
        after = time.monotonic()
        time.sleep(0.02)  # nobody reads
        data, arrival = receive(ours, 100, time.monotonic)
        assert data == b"sample"
        assert before - 1e-3 <= arrival <= after + 0.01 < time.monotonic()
        theirs.sendto(b"sample", ours.getsockname())
        assert receive(ours, 100, lambda: 3.0) == (b"sample", 3.0)
