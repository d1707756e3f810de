"""Datagrams with the time at which the operating system received them.

A program that stood still finds them queued up. The time at which it reads them says
nothing of when they came.
"""

import contextlib
import socket
import struct
import time

from drake_disasm.devices.reading import Clock

_STAMP = getattr(socket, "SO_TIMESTAMPNS", 35)  # Linux; Python 3.11 does not name it
_TIMESPEC = struct.Struct("@qq")
_NS = 1e-9


def stamp_arrivals(receiver: socket.socket) -> None:
    """Asks the operating system to stamp what comes; without that, reading does."""
    with contextlib.suppress(OSError):
        receiver.setsockopt(socket.SOL_SOCKET, _STAMP, 1)


def receive(receiver: socket.socket, longest: int, clock: Clock) -> tuple[bytes, float]:
    """Returns the next datagram, and when it came by a clock [s].

    A clock of virtual time is not compared with the system's: there it comes now.

    Raises:
        TimeoutError: nothing came within the socket's timeout.
        OSError: the socket can't receive.
    """
    data, notes, _, _ = receiver.recvmsg(longest, socket.CMSG_SPACE(_TIMESPEC.size))
    now = clock()
    if clock is not time.monotonic:
        return data, now
    return data, now - max(0.0, _age(notes))


def _age(notes: list[tuple[int, int, bytes]]) -> float:
    """Returns for how long a datagram has waited to be read [s]."""
    for level, kind, value in notes:
        if (level, kind) == (socket.SOL_SOCKET, _STAMP):
            seconds, nanoseconds = _TIMESPEC.unpack(value)
            return time.time() - (seconds + _NS * nanoseconds)
    return 0.0
