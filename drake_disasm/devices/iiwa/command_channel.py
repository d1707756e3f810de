"""Hears every command on an arm's channel, ours and others'.

A subscription of `DrakeLcm` does not over UDP: it keeps one message of a channel until
it is handled and drops what comes meanwhile, so that a second commander, who comes
after us in each period, would never be heard.
"""

import contextlib
import socket
import struct
from collections import deque
from urllib.parse import urlsplit

from pydrake.lcm import DrakeLcmInterface

from drake_disasm.common.errors import DisasmError

#: LCM's header of a message in one datagram: magic number, count; then the channel's
#: name and a zero byte. https://lcm-proj.github.io/lcm/content/udp-multicast-protocol.html
_MAGIC = struct.pack(">I", 0x4C433032)
_HEADER = 8
_LONGEST = 65536  # of a datagram [bytes]
_KEPT = 1000  # messages, until they are taken


class CommandChannel:
    """Collects the messages on a channel, each with its sender's address.

    Args:
        lcm: over UDP, or within this process (memq), where nothing gets lost.
        channel: of LCM.
    """

    def __init__(self, lcm: DrakeLcmInterface, channel: str) -> None:
        self.name = channel
        self._url = urlsplit(lcm.get_lcm_url())
        self._prefix = channel.encode() + b"\0"
        self._heard: deque[tuple[bytes, str]] = deque(maxlen=_KEPT)
        self._socket: socket.socket | None = None
        if self._url.scheme != "udpm":
            lcm.Subscribe(channel, lambda data: self._heard.append((data, "")))

    def start(self) -> None:
        """Listens from now on; again it does nothing.

        Raises:
            DisasmError: the system refuses to.
        """
        if self._url.scheme != "udpm" or self._socket is not None:
            return
        group, port = self._url.hostname or "", self._url.port or 0
        listener = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listener.bind((group, port))
            member = socket.inet_aton(group) + socket.inet_aton("0.0.0.0")
            listener.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, member)
        except OSError as error:
            listener.close()
            raise DisasmError(
                f"iiwa.lcm_url {self._url.geturl()}: cannot be listened to "
                f"({error.strerror or error}); is there a route for multicast?"
            ) from error
        listener.setblocking(False)
        self._socket = listener

    def stop(self) -> None:
        """Stops listening: no socket stays."""
        if self._socket is not None:
            self._socket.close()
        self._socket = None

    def take(self) -> list[tuple[bytes, str]]:
        """Returns what came since the last time: content, and sender's address."""
        self._receive()
        heard = list(self._heard)
        self._heard.clear()
        return heard

    def _receive(self) -> None:
        """Empties the system's buffer, which is bounded."""
        if self._socket is None:
            return
        with contextlib.suppress(OSError):  # there is nothing more
            for _ in range(_KEPT):
                data, sender = self._socket.recvfrom(_LONGEST)
                if data.startswith(_MAGIC) and data[_HEADER:].startswith(self._prefix):
                    content = data[_HEADER + len(self._prefix) :]
                    self._heard.append((content, f"{sender[0]}:{sender[1]}"))
