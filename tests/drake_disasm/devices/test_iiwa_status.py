"""The arm's status: golden bytes, what is refused, and what is counted."""

import numpy as np
import pytest
from drake import lcmt_iiwa_status
from pydrake.lcm import DrakeLcm

from drake_disasm.devices.codec_error import CodecError
from drake_disasm.devices.iiwa import IiwaStatusMonitor
from drake_disasm.devices.iiwa.status import decode_status

QUANTITIES = (
    "joint_position_measured",
    "joint_velocity_estimated",
    "joint_position_commanded",
    "joint_position_ipo",
    "joint_torque_measured",
    "joint_torque_commanded",
    "joint_torque_external",
)


def status(utime: int = 5000, first: float = 0.25) -> lcmt_iiwa_status:
    """Returns a message; joint i's measured position is first + i."""
    message = lcmt_iiwa_status()
    message.utime, message.num_joints = utime, 7
    for name in QUANTITIES:
        setattr(message, name, [first + i for i in range(7)])
    return message


def test_bytes_are_big_endian_behind_the_fingerprint() -> None:
    data = status().encode()
    assert len(data) == 8 + 8 + 4 + 7 * 7 * 8
    assert data[8:16] == bytes.fromhex("0000000000001388")  # utime 5000
    assert data[16:20] == bytes.fromhex("00000007")
    assert data[20:28] == bytes.fromhex("3fd0000000000000")  # 0.25
    assert decode_status(data).joint_position_measured[2] == 2.25


def test_other_arms_and_nan_are_refused() -> None:
    other = status()
    other.num_joints = 6
    for name in QUANTITIES:
        setattr(other, name, [0.0] * 6)
    with pytest.raises(CodecError, match="6 joints"):
        decode_status(other.encode())
    with pytest.raises(CodecError, match="not finite"):
        decode_status(status(first=np.nan).encode())
    with pytest.raises(CodecError, match="not an lcmt_iiwa_status"):
        decode_status(b"")


def test_what_is_lost_late_or_broken_is_counted_and_only_good_ones_get_on() -> None:
    lcm, checked, passed = DrakeLcm("memq://"), DrakeLcm("memq://"), []
    checked.Subscribe("S", passed.append)
    time = 0.0
    monitor = IiwaStatusMonitor(lcm, checked, "S", 0.005, lambda: time)
    times = (5_000, 20_000, 15_000, 20_000)  # the second has lost two
    broken = status(40_000, first=np.nan).encode()
    for data in (*(status(t).encode() for t in times), broken, broken[:50]):
        lcm.Publish("S", data)
        lcm.HandleSubscriptions(0)
        checked.HandleSubscriptions(0)
    counters = monitor.read().counters
    assert (counters.received, counters.lost) == (2, 2)
    assert (counters.reordered, counters.invalid) == (2, 2)
    assert "check that the driver" in monitor.read().error
    assert monitor.read().values[6] == 6.25 and len(passed) == 2


class _Driver:
    """A driver whose clock, and whose messages' way, are the test's."""

    def __init__(self) -> None:
        self.now, self.lcm = 0.0, DrakeLcm("memq://")
        checked = DrakeLcm("memq://")
        self.monitor = IiwaStatusMonitor(
            self.lcm, checked, "STATUS", 0.005, lambda: self.now
        )

    def say(self, stamp: float) -> float:
        """Sends a status of a time [s]; returns its age when it was taken [s]."""
        self.lcm.Publish("STATUS", status(round(1e6 * stamp)).encode())
        self.lcm.HandleSubscriptions(0)
        return self.monitor.read().age(self.now)


def test_a_status_that_queued_up_is_as_old_as_it_is() -> None:
    driver = _Driver()
    for k in range(20):
        driver.now = 7.0 + 0.005 * k
        assert driver.say(0.005 * k) == pytest.approx(0.0, abs=1e-6)
    driver.now += 0.1  # a stall; the first that is handled is an old one
    assert driver.say(0.100) == pytest.approx(0.095, abs=2e-3)
    assert driver.say(0.195) == pytest.approx(0.0, abs=2e-3)
    counters = driver.monitor.read().counters
    assert (counters.queued, counters.lost) == (1, 18)


@pytest.mark.parametrize("stamp", [0.0, 80.0])
def test_a_driver_that_was_started_anew_is_believed_its_time(stamp: float) -> None:
    driver = _Driver()
    for k in range(100):
        driver.now = 7.0 + 0.005 * k
        driver.say(0.005 * k)
    assert driver.monitor.sending_for(driver.now) == pytest.approx(0.495)
    driver.now += 1.5
    for k in range(10):
        driver.now += 0.005
        assert driver.say(stamp + 0.005 * k) == pytest.approx(0.0, abs=1e-6)
    assert driver.monitor.sending_for(driver.now) == pytest.approx(0.045)
