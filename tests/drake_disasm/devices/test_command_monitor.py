"""Others' commands are noticed, however they come; ours are not taken for them."""

import os
from collections.abc import Iterator

import numpy as np
import pytest
from drake import lcmt_iiwa_command
from pydrake.lcm import DrakeLcm

from drake_disasm.devices.iiwa import CommandChannel, CommandMonitor
from tests.progress import wait_until

CHANNEL = "IIWA_COMMAND"
_URL = f"udpm://239.255.76.68:{20_000 + os.getpid() % 20_000}?ttl=0"


class Arm:
    """A monitor, and an arm whose status says what it obeys."""

    def __init__(self, lcm: DrakeLcm) -> None:
        self.lcm = lcm
        self.obeys: np.ndarray | None = None
        self._marks, self._mark = [b""], 0
        lcm.Subscribe("MARK", self._marks.append)
        self.monitor = CommandMonitor(CommandChannel(lcm, CHANNEL), lambda: self.obeys)
        self.monitor.start()

    def send(self, *ours: np.ndarray) -> None:
        """Sends commands of ours."""
        for position in ours:
            self.monitor.sent(position)
            publish(self.lcm, position)

    def foreign(self) -> str:
        """Returns what the monitor says, after all messages have been handled."""
        self._mark += 1
        wait_until(self.hears)
        return self.monitor.foreign

    def hears(self) -> bool:
        """Handles messages; returns whether one that was sent last has come."""
        self.lcm.Publish("MARK", str(self._mark).encode())
        self.lcm.HandleSubscriptions(100)
        return self._marks[-1] == str(self._mark).encode()


def publish(lcm: DrakeLcm, position: np.ndarray) -> None:
    """Sends a command of anybody's."""
    message = lcmt_iiwa_command()
    message.utime, message.num_joints = 17, 7
    message.joint_position = position.tolist()
    lcm.Publish(CHANNEL, message.encode())


@pytest.fixture(params=["memq://", _URL], ids=["memq", "udpm"])
def arm(request: pytest.FixtureRequest) -> Iterator[Arm]:
    """In this process, and over UDP."""
    arm = Arm(DrakeLcm(request.param))
    if request.param == _URL and not _comes(arm):
        pytest.skip("LCM's multicast does not come back on this machine")
    arm.foreign()
    arm.monitor.forget()
    yield arm
    arm.monitor.stop()


def _comes(arm: Arm) -> bool:
    return any(arm.hears() for _ in range(50))


def _place(k: int) -> np.ndarray:
    """Returns the k-th place of a motion, 1e-4 rad apart in joint 1."""
    return np.array([-0.0, k * 1e-4, 1 / 3, -1.0, 0.1, 5e-324, 2.0])


def test_ours_are_ours_however_late_they_are_heard(arm: Arm) -> None:
    arm.send(*(_place(k) for k in range(150)), _place(0))
    assert not arm.foreign()


def test_another_command_is_noticed_though_it_comes_after_ours(arm: Arm) -> None:
    """LCM's own subscription keeps the first message of a channel until it is asked."""
    arm.send(_place(0), _place(1))
    publish(DrakeLcm(_URL) if "udpm" in arm.lcm.get_lcm_url() else arm.lcm, _place(9))
    arm.send(_place(2))
    assert "a command that is not ours came on IIWA_COMMAND" in arm.foreign()
    arm.send(_place(3))
    assert arm.foreign()  # it stays
    arm.monitor.forget()
    arm.send(_place(4))
    assert not arm.foreign()


def test_what_is_no_command_is_not_ours(arm: Arm) -> None:
    content = b"\xff" * 300
    arm.lcm.Publish("ANOTHER_CHANNEL", content)
    arm.lcm.Publish(f"{CHANNEL}_2", content)
    assert not arm.foreign()
    arm.lcm.Publish(CHANNEL, content)
    assert arm.foreign()


def test_a_place_that_the_arm_obeys_and_we_never_sent_is_noticed(arm: Arm) -> None:
    arm.obeys = _place(-100)
    assert not arm.foreign()  # we have not sent anything
    arm.send(_place(0))
    assert not arm.foreign()  # it is on its way
    arm.obeys = _place(0)
    arm.send(*(_place(k) for k in range(1, 20)))
    assert not arm.foreign()
    arm.obeys = (_place(3) + _place(4)) / 2.0  # the driver may interpolate
    assert not arm.foreign()
    arm.obeys = _place(-100)
    assert "for joint 2 that is 0.010 rad from ours" in arm.foreign()


def test_an_arm_that_was_jogged_between_episodes_has_no_other_master(arm: Arm) -> None:
    """The first status that is handled after the jog is one from before it."""
    ours = np.full(7, 0.1)
    arm.send(ours)
    arm.obeys = ours
    assert not arm.foreign()
    arm.monitor.stop()
    arm.monitor.start()
    assert not arm.foreign()
    arm.obeys = np.full(7, 0.3)
    assert not arm.foreign()
    arm.send(arm.obeys)
    assert not arm.foreign()
    arm.obeys = np.full(7, 0.5)  # and yet it is noticed
    assert "rad from ours" in arm.foreign()
