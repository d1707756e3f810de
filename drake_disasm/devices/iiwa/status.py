"""Whether the arm's driver still sends, which Drake's receiver does not say."""

import time

import numpy as np
from drake import lcmt_iiwa_status
from pydrake.lcm import DrakeLcmInterface

from drake_disasm.devices.codec_error import CodecError
from drake_disasm.devices.reading import Clock, Mailbox, Reading

JOINTS = 7
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
        self._mailbox, self._period = Mailbox(JOINTS, clock), period
        self._utime: int | None = None
        self._channel, self._checked = channel, checked
        lcm.Subscribe(channel, self._take)

    def read(self) -> Reading:
        """Returns the newest measured joint angles (7,) [rad]."""
        return self._mailbox.read()

    def _take(self, data: bytes) -> None:
        try:
            message = decode_status(data)
        except CodecError as error:
            self._mailbox.count(invalid=1)
            self._mailbox.complain(f"{error}; check that the driver is this arm's")
            return
        if self._utime is not None and message.utime <= self._utime:
            self._mailbox.count(reordered=1)
            return
        if self._utime is not None:
            gap = (message.utime - self._utime) / _US
            self._mailbox.count(lost=max(0, round(gap / self._period) - 1))
        self._utime = message.utime
        self._mailbox.put(np.array(message.joint_position_measured))
        self._checked.Publish(self._channel, data)
