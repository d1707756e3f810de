"""Talks to a Robotiq 2F gripper over Modbus."""

import dataclasses
import logging
import threading
import time
from collections.abc import Callable
from typing import Self

import numpy as np
from pymodbus.client import ModbusSerialClient, ModbusTcpClient
from pymodbus.exceptions import ModbusException
from pymodbus.framer import FramerType
from pymodbus.pdu import ModbusPDU

from drake_disasm.common.errors import DisasmError
from drake_disasm.devices.codec_error import CodecError
from drake_disasm.devices.reading import Clock, Mailbox, Reading
from drake_disasm.devices.robotiq.registers import (
    COMMAND_ADDRESS,
    FIRST_MAJOR_FAULT,
    FORCES,
    REGISTERS,
    SPEEDS,
    STATUS_ADDRESS,
    Activation,
    Command,
    Status,
    Stroke,
    decode_status,
    encode_command,
    fault_words,
)

BAUD_RATE = 115200  # 8N1: the gripper's setting from the factory

#: How long a reply or a connection may take [s]; also about how long `stop` may.
TIMEOUT = 0.5

#: The longest wait between two attempts while they fail [s].
LONGEST_WAIT = 2.0

# Without any handler Python would print pymodbus' line on each failed request to
# the terminal; failures are counted in the reading instead.
logging.getLogger("pymodbus").addHandler(logging.NullHandler())


@dataclasses.dataclass(frozen=True)
class RobotiqSettings:
    """How a gripper is reached, and how it moves.

    Attributes:
        transport: "rtu_over_tcp" (a serial-to-ethernet gateway), "tcp" (Modbus TCP)
            or "serial".
        address: host, or path of the serial device.
        port: of the host.
        device_id: of the gripper on the bus; 9 from the factory.
        period: between two polls [s].
        speed: of the fingers, 0.03 to 0.25 [m/s].
        force: that they grip with, 10 to 125 [N].
        activate: whether `start` may activate the gripper, which moves its fingers.
        stroke: what its positions stand for.
    """

    transport: str
    address: str
    port: int = 502
    device_id: int = 9
    period: float = 0.05
    speed: float = 0.05
    force: float = 60.0
    activate: bool = False
    stroke: Stroke = dataclasses.field(default_factory=Stroke)


class RobotiqClient:
    """Polls a gripper, and asks for an opening once there is one to ask for.

    One thread does all the talking. It writes nothing before the first `command`,
    except the activation if the settings allow it, once. It moves nothing that is
    not activated or has a fault. A request is written until the gripper echoes it;
    it needs no repeating after that, since the polls are communication enough for
    the gripper's own watch (fault 0x09 after 1 s of silence).

    Args:
        settings: of the gripper.
        clock: tells the time [s].

    Raises:
        DisasmError: the settings are wrong, or pyserial is missing.
    """

    def __init__(
        self, settings: RobotiqSettings, clock: Clock = time.monotonic
    ) -> None:
        self._settings, self._clock = settings, clock
        self._modbus = _modbus(settings)
        self._move = Command(
            activate=True,
            go=True,
            speed=_byte("speed", settings.speed, SPEEDS),
            force=_byte("force", settings.force, FORCES),
        )
        self._mailbox = Mailbox(2, clock, queued_after=TIMEOUT)
        self._stopping = threading.Event()
        self._thread: threading.Thread | None = None
        # The manual's way: rACT is cleared, then set.
        activation = [Command(), Command(activate=True)]
        self._activation = activation if settings.activate else []
        self._target: Command | None = None  # the caller's; all below the thread's
        self._written: Command | None = None  # since the connection was made
        self._sample: tuple[float, float] | None = None  # time [s], opening [m]
        self._was_connected = False

    def __enter__(self) -> Self:
        """Starts."""
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Stops."""
        self.stop()

    def start(self) -> None:
        """Starts polling, if it has not."""
        if self._thread is None:
            self._stopping.clear()
            self._thread = threading.Thread(
                target=self._run, name="robotiq", daemon=True
            )
            self._thread.start()

    def stop(self) -> None:
        """Stops talking; the gripper keeps to its last request, and so its grip."""
        if self._thread is not None:
            self._stopping.set()
            self._thread.join()
            self._thread = None
        self._modbus.close()

    def read(self) -> Reading:
        """Returns the newest opening [m] and its rate [m/s].

        The rate is the difference to the sample before; 0 of the first.
        """
        return self._mailbox.read()

    def command(self, opening: float | None) -> None:
        """Asks for an opening [m], clamped to the stroke; None writes nothing.

        Raises:
            CodecError: the opening is NaN.
        """
        if opening is None:
            self._target = None
            return
        position = self._settings.stroke.request(opening)
        self._target = dataclasses.replace(self._move, position=position)

    def _run(self) -> None:
        wait = self._settings.period
        while not self._stopping.wait(wait):
            succeeded = self._try_cycle()
            wait = self._settings.period if succeeded else min(2 * wait, LONGEST_WAIT)
        self._modbus.close()

    def _try_cycle(self) -> bool:
        """Polls once; returns whether that went well."""
        try:
            if self._connect():
                self._cycle()
                return True
        except (ModbusException, CodecError, OSError):
            self._mailbox.count(invalid=1)
        except Exception as error:  # a thread that died would look like a lost cable
            self._mailbox.complain(f"gripper client: {error!r}; please report it")
        # RTU replies carry no number: one that came late would be taken for the next
        # one's. A new connection has none.
        self._modbus.close()
        return False

    def _connect(self) -> bool:
        """Makes the connection unless there is one; returns whether there is."""
        if self._modbus.connected:
            return True
        self._written = None
        if not self._modbus.connect():
            return False
        self._mailbox.count(reconnects=int(self._was_connected))
        self._was_connected = True
        return True

    def _cycle(self) -> None:
        asked = self._clock()  # the answer is no older
        status = self._read_status()
        complaint = _complaint(status)
        if complaint:  # a position with a complaint is no sample
            self._mailbox.count(received=1)
            self._mailbox.complain(complaint)
            self._continue_activation(status)
            return
        opening = self._settings.stroke.opening(status.position)
        self._mailbox.put(np.array([opening, self._rate(opening, asked)]), asked)
        # One activation per start: a gripper that is reset in mid-run may hold a part.
        self._activation.clear()
        self._pursue(status)

    def _rate(self, opening: float, now: float) -> float:
        """Returns the rate [m/s] since the sample before, which it replaces."""
        before, opening_before = self._sample or (now, opening)
        self._sample = now, opening
        return (opening - opening_before) / (now - before) if now > before else 0.0

    def _continue_activation(self, status: Status) -> None:
        waits = status.state is Activation.RESET or status.fault >= FIRST_MAJOR_FAULT
        if self._activation and waits:
            self._write(self._activation[0])
            self._activation.pop(0)

    def _pursue(self, status: Status) -> None:
        """Writes the target unless the gripper echoes it."""
        target = self._target
        if target is None:
            return
        echoed = status.going and status.position_request == target.position
        # Speed and force have no echo: what was written tells of them.
        if not echoed or self._written != target:
            self._write(target)
            self._written = target

    def _read_status(self) -> Status:
        reply = self._modbus.read_holding_registers(
            STATUS_ADDRESS, count=REGISTERS, device_id=self._settings.device_id
        )
        return decode_status(_good(reply).registers)

    def _write(self, command: Command) -> None:
        reply = self._modbus.write_registers(
            COMMAND_ADDRESS,
            list(encode_command(command)),
            device_id=self._settings.device_id,
        )
        _good(reply)


def _good(reply: ModbusPDU) -> ModbusPDU:
    if reply.isError():
        raise ModbusException(f"the gripper refused: {reply}")
    return reply


def _complaint(status: Status) -> str:
    """Returns what is wrong, with the remedy; empty if nothing."""
    if status.fault:
        return fault_words(status.fault)
    if status.state is not Activation.DONE:
        return (
            "gripper is not activated: clear the fingers' way, for they will move, "
            "and start with `activate: true`; if it is just activating, wait"
        )
    return ""


def _byte(name: str, value: float, ends: tuple[float, float]) -> int:
    """Returns the byte that stands for a value between those of 0 and of 255."""
    low, high = ends
    if not low <= value <= high:
        raise DisasmError(
            f"gripper: {name} is {value}; give one from {low:g} to {high:g}"
        )
    return round(255 * (value - low) / (high - low))


def _modbus(settings: RobotiqSettings) -> ModbusTcpClient | ModbusSerialClient:
    """Returns pymodbus' client, not connected; it never repeats a request itself."""
    if settings.transport not in _TRANSPORTS:
        raise DisasmError(
            f"gripper: transport is {settings.transport!r}; "
            f"give one of {', '.join(_TRANSPORTS)}"
        )
    return _TRANSPORTS[settings.transport](settings)


def _tcp(settings: RobotiqSettings, framer: FramerType) -> ModbusTcpClient:
    return ModbusTcpClient(
        settings.address,
        port=settings.port,
        framer=framer,
        timeout=TIMEOUT,
        retries=0,
    )


def _serial(settings: RobotiqSettings) -> ModbusSerialClient:
    try:
        return ModbusSerialClient(
            settings.address, baudrate=BAUD_RATE, timeout=TIMEOUT, retries=0
        )
    except RuntimeError as error:
        raise DisasmError(
            "gripper: a serial line needs pyserial; pip install pyserial"
        ) from error


_TRANSPORTS: dict[
    str, Callable[[RobotiqSettings], ModbusTcpClient | ModbusSerialClient]
] = {
    "rtu_over_tcp": lambda settings: _tcp(settings, FramerType.RTU),
    "tcp": lambda settings: _tcp(settings, FramerType.SOCKET),
    "serial": _serial,
}
