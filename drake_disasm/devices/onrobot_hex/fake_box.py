"""An OnRobot Compute Box on the loopback, with faults on request."""

import contextlib
import socket
import threading
import time
from collections.abc import Iterable
from typing import Self

from drake_disasm.devices.codec_error import CodecError
from drake_disasm.devices.onrobot_hex.codec import (
    BoxCommand,
    BoxRequest,
    Sample,
    decode_request,
    encode_sample,
)
from drake_disasm.devices.reading import Clock

FAULTS = (
    "",
    "delay",  # held back for `delay_s`
    "loss",  # numbered, not sent
    "reorder",  # each two in the wrong order
    "short",  # 20 bytes
    "header",  # two bytes too many in front
    "status",  # not 0
    "frozen",  # the number of the sample before
    "jump",  # JUMP more in fx
)
JUMP = 500.0  # [N]
STATUS = 0x2


class FakeHexBox:
    """Listens from its construction on, and streams when a client asks.

    It sends to the client that started it last, as many samples as it is given.

    Attributes:
        port: UDP, on 127.0.0.1.
        requests: that came and were valid, oldest first.
        sequence: number of the sample before.
        fault: one of FAULTS, for the samples to come.
        delay_s: of the fault "delay", by the clock; what was held back leaves at
            the first `send` after it is due.

    Args:
        port: 0 for a free one.
        clock: tells the time of delays [s].
    """

    def __init__(self, port: int = 0, clock: Clock = time.monotonic) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", port))
        self._socket.settimeout(0.05)
        self.port: int = self._socket.getsockname()[1]
        self.requests: list[BoxRequest] = []
        self.sequence, self.fault, self.delay_s = 0, "", 0.1
        self._clock = clock
        self._held: list[tuple[float, bytes]] = []  # when due, oldest first
        self._pair: list[bytes] = []
        self._client: tuple[str, int] | None = None
        self._started, self._stopping = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._serve, name="FakeHexBox")
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def stop(self) -> None:
        """Falls silent, as without power; may be called twice."""
        self._stopping.set()
        self._thread.join()
        self._client = None
        self._started.clear()
        self._socket.close()

    def restart(self) -> None:
        """Forgets its client and begins to count anew, as after a loss of power."""
        self._client = None
        self._started.clear()
        self.sequence = 0

    @property
    def started(self) -> bool:
        """Whether a client has requested the stream."""
        return self._started.is_set()

    def send(self, wrench: Iterable[float]) -> None:
        """Sends the next sample, [f; tau] [N, N m], as the fault has it."""
        assert self.fault in FAULTS, self.fault
        datagram = encode_sample(self._next(wrench))
        if self.fault == "short":
            datagram = datagram[:20]
        elif self.fault == "header":
            datagram = b"\x12\x34" + datagram
        client = self._client
        for leaving in [*self._due(), *self._undisturbed(datagram)]:
            if client is not None:
                self._socket.sendto(leaving, client)

    def _next(self, wrench: Iterable[float]) -> Sample:
        if self.fault != "frozen":
            self.sequence = (self.sequence + 1) % 2**32
        status = STATUS if self.fault == "status" else 0
        fx, *rest = wrench
        jump = JUMP if self.fault == "jump" else 0.0
        return Sample(self.sequence, self.sequence, status, (fx + jump, *rest))

    def _due(self) -> list[bytes]:
        now = self._clock()
        due = [datagram for when, datagram in self._held if when <= now]
        self._held = [(when, datagram) for when, datagram in self._held if when > now]
        return due

    def _undisturbed(self, datagram: bytes) -> list[bytes]:
        """Returns the datagrams to send in place of this one, by the fault."""
        if self.fault == "loss":
            return []
        if self.fault == "delay":
            self._held.append((self._clock() + self.delay_s, datagram))
            return []
        self._pair.append(datagram)
        if self.fault == "reorder" and len(self._pair) < 2:
            return []
        leaving, self._pair = self._pair, []
        return leaving[::-1] if self.fault == "reorder" else leaving

    def _serve(self) -> None:
        while not self._stopping.is_set():
            with contextlib.suppress(TimeoutError, CodecError):
                datagram, client = self._socket.recvfrom(2048)
                self._obey(decode_request(datagram), client)

    def _obey(self, request: BoxRequest, client: tuple[str, int]) -> None:
        self.requests.append(request)
        if request.command == BoxCommand.STOP:
            self._client = None
            self._started.clear()
        elif request.command == BoxCommand.START:
            if client != self._client:
                self.sequence = 0
            self._client = client
            self._started.set()
