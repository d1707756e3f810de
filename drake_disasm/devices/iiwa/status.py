"""Whether the arm's driver still sends, which Drake's receiver does not say."""

import dataclasses
import time

import numpy as np
from drake import lcmt_iiwa_status
from pydrake.lcm import DrakeLcmInterface

from drake_disasm.devices.codec_error import CodecError
from drake_disasm.devices.device_clock import DeviceClock
from drake_disasm.devices.reading import Clock, Mailbox, Reading

JOINTS = 7
#: A message this much older than the newest is not late: the driver has restarted [s].
BEGUN_ANEW = 1.0

#: A silence after which the driver may have been started anew [s]: it takes longer.
BREAK = 1.0

_US = 1e6


def decode_status(data: bytes) -> lcmt_iiwa_status:
    """Returns the arm's status of an LCM message.

    Raises:
        CodecError: it is none, of another arm, or holds what is not finite.
    """
    try:
        message = lcmt_iiwa_status.decode(data)
    except Exception as error:  # lcmgen's code raises whatever comes
        raise CodecError(f"not an lcmt_iiwa_status: {error}") from None
    if message.num_joints != JOINTS:
        raise CodecError(f"status of {message.num_joints} joints, not {JOINTS}")
    if not np.isfinite(message.joint_position_measured).all():
        raise CodecError("a joint's measured position is not finite")
    return message


class IiwaStatusMonitor:
    """Watches the arm's status messages: their time, and what got lost.

    LCM's own thread does the receiving; messages come when subscriptions are handled,
    by an LcmInterfaceSystem or by hand. Good ones are passed on: a broken one would
    end the program in Drake's own subscriber.

    Attributes:
        commanded: (7,) joint angles that the arm obeys, by the newest good status
            [rad]; None before the first.

    Args:
        lcm: where they come from.
        checked: where good messages are passed on, on the same channel.
        channel: on which.
        period: at which the driver sends [s].
        clock: tells when they came.
    """

    def __init__(
        self,
        lcm: DrakeLcmInterface,
        checked: DrakeLcmInterface,
        channel: str,
        period: float,
        clock: Clock = time.monotonic,
    ) -> None:
        self._mailbox, self._period = Mailbox(2 * JOINTS, clock), period
        self._device_clock = DeviceClock()
        self._stamp: float | None = None  # of the newest, by the driver's clock [s]
        self._came = self._since = -np.inf  # newest, and first without a break [s]
        self._channel, self._checked = channel, checked
        self.commanded: np.ndarray | None = None
        lcm.Subscribe(channel, self._take)

    def read(self) -> Reading:
        """Returns the newest measured joint angles (7,) [rad]."""
        newest = self._mailbox.read()
        return dataclasses.replace(newest, values=newest.values[:JOINTS])

    def read_with_external(self) -> Reading:
        """Returns the newest joint angles and external torques (14,) [rad, N m]."""
        return self._mailbox.read()

    def sending_for(self, now: float) -> float:
        """Returns for how long the driver has sent by now, without a break [s]."""
        return now - self._since if self._stamp is not None else 0.0

    def _take(self, data: bytes) -> None:
        try:
            message = decode_status(data)
        except CodecError as error:
            self._mailbox.count(invalid=1)
            self._mailbox.complain(f"{error}; check that the driver is this arm's")
            return
        stamp, now = message.utime / _US, self._mailbox.clock()
        if not self._is_newer(stamp, now):
            return
        taken = self._device_clock.taken_at(stamp, now)
        self.commanded = np.array(message.joint_position_commanded)
        values = [*message.joint_position_measured, *message.joint_torque_external]
        self._mailbox.put(np.array(values), taken)
        self._checked.Publish(self._channel, data)

    def _is_newer(self, stamp: float, now: float) -> bool:
        """Takes a message's time by the driver's and by our clock [s].

        Counts what that tells of other messages.
        """
        gap = np.inf if self._stamp is None else stamp - self._stamp
        is_broken, self._came = now - self._came > BREAK, now
        if is_broken or gap <= -BEGUN_ANEW:
            self._since = now
            self._device_clock.begin_anew()
            self._mailbox.count(reconnects=int(gap <= 0.0))
        elif gap <= 0.0:
            self._mailbox.count(reordered=1)
            return False
        if np.isfinite(gap):
            self._mailbox.count(lost=max(0, round(gap / self._period) - 1))
        self._stamp = stamp
        return True
