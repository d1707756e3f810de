"""A Robotiq 2F gripper behind a serial-to-ethernet gateway: Modbus RTU over TCP."""

import socket
import threading
from typing import Self

from drake_disasm.devices.robotiq.registers import (
    Activation,
    Command,
    FingerState,
    Status,
    decode_command,
    encode_status,
)

#: How long a socket is waited for until the thread looks whether to stop [s].
TICK = 0.02

READ, WRITE = 0x03, 0x10

FAULTS = ("", "crc", "drop", "silent", "status", "short", "header")


def crc16(data: bytes) -> bytes:
    """Returns Modbus' checksum, low byte first: polynomial 0xA001, from 0xFFFF."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0xA001 if crc & 1 else 0)
    return crc.to_bytes(2, "little")


class FakeRobotiqGripper:
    """Serves one connection at a time, from one thread, on `port` of 127.0.0.1.

    Attributes:
        fault: how it fails from now on: "" (not), "crc" (wrong in replies), "drop"
            (closes connections), "silent" (no replies), "status" (reports
            `fault_code`), "short" (replies cut), "header" (another's replies).
        fault_code: gFLT of the fault "status".
        object_at: the position where something stops the closing fingers.
        rate: how far the fingers move between two polls.
        frames: all requests, as they came.
    """

    def __init__(self, activated: bool = True, rate: int = 255) -> None:
        self.fault, self.fault_code = "", 0x0E
        self.object_at: int | None = None
        self.rate = rate
        self.frames: list[bytes] = []
        self.state = Activation.DONE if activated else Activation.RESET
        self.command = Command(activate=activated)
        self.position = 3
        self._stopping, self._restarting = threading.Event(), threading.Event()
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._listener.settimeout(TICK)
        self.port: int = self._listener.getsockname()[1]
        self._thread = threading.Thread(target=self._serve, name="fake", daemon=True)
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    @property
    def writes(self) -> list[bytes]:
        """The requests that write."""
        return [frame for frame in self.frames if frame[1] == WRITE]

    def stop(self) -> None:
        """Closes all sockets and ends the thread."""
        self._stopping.set()
        self._thread.join()
        self._listener.close()

    def restart(self) -> None:
        """Closes the connection; the gripper behind the gateway keeps its grip."""
        self._restarting.set()

    def _serve(self) -> None:
        while not self._stopping.is_set():
            try:
                connection, _ = self._listener.accept()
            except TimeoutError:
                continue
            with connection:
                connection.settimeout(TICK)
                self._talk(connection)

    def _talk(self, connection: socket.socket) -> None:
        buffer = b""
        self._restarting.clear()
        while not (self._stopping.is_set() or self._restarting.is_set()):
            if self.fault == "drop":
                return
            try:
                received = connection.recv(256)
            except TimeoutError:
                continue
            except ConnectionError:
                return
            if not received:
                return
            frame, buffer = _first_frame(buffer + received)
            if frame and self.fault != "drop":
                self._take(connection, frame)

    def _take(self, connection: socket.socket, frame: bytes) -> None:
        self.frames.append(frame)
        # As RTU devices do, it says nothing to what is broken or another's.
        if crc16(frame[:-2]) == frame[-2:] and frame[0] == 9 and self.fault != "silent":
            reply = self._read() if frame[1] == READ else self._write(frame)
            connection.sendall(self._spoilt(reply))

    def _read(self) -> bytes:
        self._step()
        return bytes([9, READ, 6]) + _packed(encode_status(self._status()))

    def _write(self, frame: bytes) -> bytes:
        command = decode_command([256 * frame[i] + frame[i + 1] for i in (7, 9, 11)])
        if not command.activate:
            self.state = Activation.RESET
        elif self.state is Activation.RESET:
            self.state = Activation.ACTIVATING
        self.command = command
        return frame[:6]

    def _step(self) -> None:
        if self.command.go and self.state is Activation.DONE:
            asked = self.command.position
            if self.object_at is not None:
                asked = min(asked, max(self.object_at, self.position))
            asked = min(max(asked, 3), 230)
            step = min(max(asked - self.position, -self.rate), self.rate)
            self.position += step
        elif self.state is Activation.ACTIVATING:
            self.state = Activation.DONE

    def _status(self) -> Status:
        held = self.object_at is not None and self.position == self.object_at
        return Status(
            activated=self.command.activate,
            going=self.command.go,
            state=self.state,
            object_detected=FingerState.STOPPED_CLOSING
            if held
            else FingerState.AT_REQUEST,
            fault=self.fault_code if self.fault == "status" else 0,
            position_request=self.command.position,
            position=self.position,
        )

    def _spoilt(self, reply: bytes) -> bytes:
        if self.fault == "header":
            reply = bytes([8]) + reply[1:]
        crc = crc16(reply)
        if self.fault == "crc":
            crc = bytes([crc[0] ^ 1, crc[1]])
        return (reply + crc)[: 4 if self.fault == "short" else None]


def _first_frame(data: bytes) -> tuple[bytes, bytes]:
    """Returns the first request, empty until it is whole, and what is left."""
    writes = len(data) > 6 and data[1] == WRITE
    size = 9 + data[6] if writes else 8
    return (data[:size], data[size:]) if len(data) >= size else (b"", data)


def _packed(registers: tuple[int, ...]) -> bytes:
    return b"".join(register.to_bytes(2, "big") for register in registers)
