"""The client of a Compute Box: one UDP socket, and one thread that listens."""

import contextlib
import socket
import threading
import time
from typing import Self

import numpy as np

from drake_disasm.common.errors import DisasmError
from drake_disasm.devices.codec_error import CodecError
from drake_disasm.devices.datagrams import receive, stamp_arrivals
from drake_disasm.devices.device_clock import DeviceClock
from drake_disasm.devices.onrobot_hex.codec import (
    PORT,
    BoxCommand,
    BoxRequest,
    decode_sample,
    encode_request,
    filter_request,
    period_request,
    sequence_step,
)
from drake_disasm.devices.reading import Clock, Mailbox, Reading

#: A number this far back is no late datagram: the box has begun to count anew.
BEGUN_ANEW = 100

_POLL = 0.02  # [s], how often the thread looks up where nothing comes
_LONGEST = 2048  # of datagrams [bytes]; a sample with more behind it is seen as such


class HexClient:
    """Has a Compute Box stream, and holds the newest sample.

    The wrench is [f; tau] at the sensor's origin in its axes, as the box reports
    it. The box's own bias is never set: zeroing belongs to the observation, which
    knows the payload, and a bias that outlives a program would be seen by none.

    Args:
        address: of the Compute Box; 192.168.1.1 as delivered.
        port: its UDP port.
        period: between samples [s], whole milliseconds.
        filter_hz: cut-off of the box's filter [Hz], 0 for none.
        clock: tells when a sample came.
        silence: for how long no datagram may come before the box is asked to
            stream again [s], always of real time.

    Raises:
        DisasmError: the box has no such period or filter, or is always too silent.
    """

    def __init__(
        self,
        address: str,
        port: int = PORT,
        period: float = 0.002,
        filter_hz: float = 15.0,
        clock: Clock = time.monotonic,
        silence: float = 0.25,
    ) -> None:
        if not silence > period:
            raise DisasmError(
                f"HEX: silence {silence:g} s must be longer than period {period:g} s"
            )
        # Settings too: a box that lost its power may have lost them with it.
        self._requests = (
            filter_request(filter_hz),
            period_request(period),
            BoxRequest(BoxCommand.START),
        )
        self._box, self._silence = (address, port), silence
        self._mailbox = Mailbox(6, clock)
        self._period, self._device_clock = period, DeviceClock()
        self._newest: int | None = None  # sequence number
        self._counted = 0  # samples since the box began to count
        self._stopping = threading.Event()
        self._running = contextlib.ExitStack()

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def start(self) -> None:
        """Asks the box to stream, and listens; a box that is off may come later.

        Raises:
            DisasmError: there is no way to the address.
        """
        self.stop()
        self._stopping.clear()
        box = self._connected()
        thread = threading.Thread(
            target=self._listen, args=(box,), name="HexClient", daemon=True
        )
        self._ask(box)
        thread.start()
        self._running.callback(self._finish, box, thread)

    def stop(self) -> None:
        """Asks the box to stop, and gives thread and socket back; harmless twice."""
        self._running.close()

    def read(self) -> Reading:
        """Returns the newest sample [f; tau] [N, N m], raw at the sensor."""
        return self._mailbox.read()

    def _connected(self) -> socket.socket:
        """Returns a socket that hears the box alone."""
        box = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            box.settimeout(_POLL)
            stamp_arrivals(box)
            box.connect(self._box)
        except (OSError, OverflowError) as error:
            box.close()
            raise DisasmError(
                f"HEX: no way to {self._box[0]}:{self._box[1]} ({error}); "
                "check the address and the network"
            ) from error
        return box

    def _finish(self, box: socket.socket, thread: threading.Thread) -> None:
        self._stopping.set()
        thread.join()
        # Not before: the thread might have asked the box to stream once more.
        with box, contextlib.suppress(OSError):
            box.send(encode_request(BoxRequest(BoxCommand.STOP)))

    def _ask(self, box: socket.socket) -> None:
        """Asks the box to stream; the numbers may begin anew.

        What can't be sent now will be once the silence is noticed.
        """
        self._newest = None
        with contextlib.suppress(OSError):
            for request in self._requests:
                box.send(encode_request(request))

    def _listen(self, box: socket.socket) -> None:
        heard = time.monotonic()
        while not self._stopping.is_set():
            if self._hear(box):
                heard = time.monotonic()
            elif time.monotonic() - heard > self._silence:
                self._mailbox.count(reconnects=1)
                self._ask(box)
                heard = time.monotonic()

    def _hear(self, box: socket.socket) -> bool:
        """Takes the next datagram; returns whether one came soon."""
        try:
            datagram, arrival = receive(box, _LONGEST, self._mailbox.clock)
        except TimeoutError:
            return False
        except OSError:  # at once, as where nothing listens
            self._stopping.wait(_POLL)
            return False
        self._take(datagram, arrival)
        return True

    def _take(self, datagram: bytes, arrival: float) -> None:
        try:
            sample = decode_sample(datagram)
        except CodecError:
            self._mailbox.count(invalid=1)
            return
        if not self._is_newer(sample.hs_sequence):
            return
        if sample.status:
            self._mailbox.complain(
                f"HEX status {sample.status:#x}: the box distrusts its sample; "
                "check the load and the sensor's cable, then restart the box"
            )
        else:
            stamp = self._counted * self._period
            taken = self._device_clock.taken_at(stamp, arrival)
            self._mailbox.put(np.array(sample.wrench), taken)

    def _is_newer(self, number: int) -> bool:
        """Takes a datagram's number, and counts what it tells of others.

        A counter that stands still gives nothing newer: its sample grows stale.
        """
        step = 1 if self._newest is None else sequence_step(self._newest, number)
        if -BEGUN_ANEW < step <= 0:
            self._mailbox.count(reordered=1)
            return False
        if self._newest is None or step <= -BEGUN_ANEW:
            self._device_clock.begin_anew()
            self._counted = 0
        elif step > 1:
            self._mailbox.count(lost=step - 1)
        self._counted += max(1, step)
        self._newest = number
        return True
