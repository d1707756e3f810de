"""Whether somebody else commands the arm, too."""

import struct
from collections import deque
from collections.abc import Callable

import numpy as np

from drake_disasm.devices.iiwa.command_channel import CommandChannel
from drake_disasm.devices.iiwa.status import JOINTS

#: Commands that we are taken to have sent lately: 1 s of them, at 200 Hz.
_KEPT = 200
#: rad: the driver reports a place between two commands, or rounds it.
_TOLERANCE = 1e-3
#: Of an encoded lcmt_iiwa_command: fingerprint, utime and number of joints come first.
_POSITIONS = slice(20, 76)


class CommandMonitor:
    """Compares what is commanded with what we send.

    Another commander shows by a command on the channel that is none of ours, and by
    a commanded position in the arm's status that is far from all of ours. Tell it
    what is sent by `sent`, before it is on the wire.

    Args:
        channel: of the commands.
        reported: returns the commanded joint angles (7,) [rad] of the arm's newest
            status, or None.
    """

    def __init__(
        self, channel: CommandChannel, reported: Callable[[], np.ndarray | None]
    ) -> None:
        self._channel, self._reported = channel, reported
        self._messages: deque[bytes] = deque(maxlen=_KEPT)
        self._positions = np.full((_KEPT, JOINTS), np.nan)  # in any order
        self._count = 0
        self._is_obeyed, self._foreign = False, ""

    def start(self) -> None:
        """Begins to listen.

        Where the arm was sent before is forgotten: it may have been jogged since.
        """
        self._channel.start()
        self._positions[:], self._count = np.nan, 0
        self.forget()

    def forget(self) -> None:
        """Forgets others' commands that came up to now."""
        self._channel.take()
        self._is_obeyed, self._foreign = False, ""

    def stop(self) -> None:
        """Stops listening."""
        self._channel.stop()

    def sent(self, position: np.ndarray) -> None:
        """Takes note of a command (7,) [rad] that is about to be sent, to the bit."""
        self._messages.appendleft(_encoded(position))
        self._positions[self._count % _KEPT] = position
        self._count += 1

    @property
    def foreign(self) -> str:
        """Why somebody else commands the arm, since it forgot; empty if nobody does."""
        if not self._foreign:
            self._foreign = self._heard() or self._obeyed()
        return self._foreign

    def _heard(self) -> str:
        """Looks for a command on the channel that is not ours."""
        for data, sender in self._channel.take():
            if data[_POSITIONS] not in self._messages:
                by = f" from {sender}" if sender else ""
                return (
                    f"a command that is not ours came on {self._channel.name}{by}: "
                    "another program commands this robot; stop it"
                )
        return ""

    def _obeyed(self) -> str:
        """Looks for a position that the arm obeys and that we have not sent.

        It obeys something older until our first command has got there.
        """
        reported = self._reported()
        if reported is None or not self._count:
            return ""
        if _encoded(reported) in self._messages:  # as usual, and quick
            self._is_obeyed = True
            return ""
        ours = self._positions[: self._count]
        low, high = ours.min(axis=0) - _TOLERANCE, ours.max(axis=0) + _TOLERANCE
        away = np.maximum(low - reported, reported - high)
        joint = int(np.argmax(away))
        if not away[joint] > 0.0:
            self._is_obeyed = True
            return ""
        if not self._is_obeyed:
            return ""
        return (
            f"the arm obeys a command for joint {joint + 1} that is "
            f"{away[joint] + _TOLERANCE:.3f} rad from ours: another program commands "
            "this robot; stop it"
        )


def _encoded(position: np.ndarray) -> bytes:
    """Returns joint angles as LCM has them in a message."""
    return struct.pack(f">{JOINTS}d", *position)
