"""What the registers of a Robotiq 2F gripper say, as pure functions.

Source: Robotiq's 2F-85/2F-140 manual, "Control over Modbus RTU": three registers
are written by FC16 from `COMMAND_ADDRESS`, three are read by FC03 from
`STATUS_ADDRESS`, each of two bytes, the first high. Positions run from 0 (open) to
255 (closed).
"""

import dataclasses
import enum
import math
from collections.abc import Sequence

from drake_disasm.devices.codec_error import CodecError

COMMAND_ADDRESS = 0x03E8
STATUS_ADDRESS = 0x07D0
REGISTERS = 3  # of a command, and of a status

#: What bytes 0 and 255 of a command's speed [m/s] and force [N] stand for: 2F-140.
SPEEDS = (0.030, 0.250)
FORCES = (10.0, 125.0)

#: From this one on a fault lasts until the gripper is activated again.
FIRST_MAJOR_FAULT = 0x0A

#: gFLT in words, with the remedy.
FAULTS = {
    0x05: "action delayed until it is activated: activate it first",
    0x07: "the activation bit is not set: activate it first",
    0x08: "too hot: let it cool down",
    0x09: "no communication for 1 s: check the cable and the gateway",
    0x0A: "supply under the minimum voltage: check the 24 V, then activate it again",
    0x0B: "automatic release in progress: wait, then activate it again",
    0x0C: "internal fault: activate it again; if it stays, ask Robotiq",
    0x0D: "activation failed: clear the fingers' way, then activate it again",
    0x0E: "overcurrent: free the fingers, then activate it again",
    0x0F: "automatic release completed: activate it again",
}


class Activation(enum.IntEnum):
    """How far activation is: gSTA, in which 2 is undefined."""

    RESET = 0
    ACTIVATING = 1
    DONE = 3


class FingerState(enum.IntEnum):
    """How the fingers are: gOBJ. Those stopped before their request hold an object."""

    MOVING = 0
    STOPPED_OPENING = 1
    STOPPED_CLOSING = 2
    AT_REQUEST = 3


@dataclasses.dataclass(frozen=True)
class Command:
    """What is asked of the gripper.

    Attributes:
        activate: rACT; activation moves the fingers, and clearing it resets faults.
        go: rGTO, move to the position; stops where it is cleared.
        position: rPR, 0 (open) to 255 (closed).
        speed: rSP, 0 to 255; see `SPEEDS`.
        force: rFR, 0 to 255; see `FORCES`.
        automatic_release: rATR, the slow release after an emergency stop.
        release_opens: rARD, whether that release opens the fingers.
    """

    activate: bool = False
    go: bool = False
    position: int = 0
    speed: int = 0
    force: int = 0
    automatic_release: bool = False
    release_opens: bool = False


@dataclasses.dataclass(frozen=True)
class Status:
    """What the gripper reports.

    Attributes:
        activated: gACT, echo of the command's bit: `state` tells whether it is done.
        going: gGTO, echo of the command's bit.
        state: gSTA.
        object_detected: gOBJ.
        fault: of `FAULTS`, 0 without; its high nibble is of an optional controller.
        position_request: gPR, echo of the command's, 0 to 255.
        position: gPO, 0 to 255.
        current: gCU, of the motor, 0 to 255 [10 mA].
    """

    activated: bool = False
    going: bool = False
    state: Activation = Activation.RESET
    object_detected: FingerState = FingerState.MOVING
    fault: int = 0
    position_request: int = 0
    position: int = 0
    current: int = 0


@dataclasses.dataclass(frozen=True)
class Stroke:
    """How echoed positions stand for openings between the pads.

    The default echoes were seen on a 2F-85 after activation; measure those of the
    gripper at hand.

    Attributes:
        open_echo: where the gripper says it is when wide open.
        closed_echo: where it says it is when closed.
        stroke: the opening when wide open [m].
    """

    open_echo: int = 3
    closed_echo: int = 230
    stroke: float = 0.140

    def opening(self, echo: int) -> float:
        """Returns the opening [m]; unclamped, so that wrong echoes show."""
        closed, wide = self.closed_echo, self.open_echo
        return self.stroke * (closed - echo) / (closed - wide)

    def request(self, opening: float) -> int:
        """Returns the position to ask for, 0 to 255, for an opening [m].

        From the stroke's ends on it is the byte's end, so that the fingers open and
        close all the way even where the echoes are a little wrong.
        """
        if math.isnan(opening):
            raise CodecError("gripper: the opening is NaN; give one in metres")
        if opening >= self.stroke:
            return 0
        if opening <= 0.0:
            return 255
        span = self.closed_echo - self.open_echo
        return round(self.closed_echo - span * opening / self.stroke)


def encode_command(command: Command) -> tuple[int, int, int]:
    """Returns the registers of a command."""
    action = (
        bool(command.activate)
        | bool(command.go) << 3
        | bool(command.automatic_release) << 4
        | bool(command.release_opens) << 5
    )
    return _registers(action, 0, 0, command.position, command.speed, command.force)


def decode_command(registers: Sequence[int]) -> Command:
    """Returns the command that registers are of; reserved bits are ignored."""
    action, _, _, position, speed, force = _bytes(registers)
    return Command(
        activate=_bit(action, 0),
        go=_bit(action, 3),
        position=position,
        speed=speed,
        force=force,
        automatic_release=_bit(action, 4),
        release_opens=_bit(action, 5),
    )


def encode_status(status: Status) -> tuple[int, int, int]:
    """Returns the registers of a status."""
    flags = (
        bool(status.activated)
        | bool(status.going) << 3
        | status.state << 4
        | status.object_detected << 6
    )
    echo = status.position_request
    return _registers(flags, 0, status.fault, echo, status.position, status.current)


def decode_status(registers: Sequence[int]) -> Status:
    """Returns the status that registers are of; reserved bits are ignored."""
    flags, _, fault, request, position, current = _bytes(registers)
    state = flags >> 4 & 0b11
    if state not in tuple(Activation):
        raise CodecError(f"gripper: gSTA is {state}, which is undefined; check the bus")
    return Status(
        activated=_bit(flags, 0),
        going=_bit(flags, 3),
        state=Activation(state),
        object_detected=FingerState(flags >> 6),
        fault=fault,
        position_request=request,
        position=position,
        current=current,
    )


def fault_words(fault: int) -> str:
    """Returns what a fault means and what to do; empty without one."""
    unknown = "not in the manual of 2F grippers; look in that of the controller"
    words = FAULTS.get(fault, unknown)
    return f"gripper fault 0x{fault:02X}: {words}" if fault else ""


def _bit(byte: int, number: int) -> bool:
    return bool(byte >> number & 1)


def _registers(*values: int) -> tuple[int, int, int]:
    """Returns six bytes as registers."""
    b = [_checked(value, 0xFF) for value in values]
    return b[0] << 8 | b[1], b[2] << 8 | b[3], b[4] << 8 | b[5]


def _bytes(registers: Sequence[int]) -> list[int]:
    """Returns the six bytes of registers."""
    if len(registers) != REGISTERS:
        raise CodecError(
            f"gripper: {len(registers)} registers came instead of {REGISTERS}; "
            "check the bus"
        )
    checked = [_checked(register, 0xFFFF) for register in registers]
    return [byte for register in checked for byte in divmod(register, 0x100)]


def _checked(value: int, most: int) -> int:
    if not isinstance(value, int) or not 0 <= value <= most:
        raise CodecError(f"gripper: {value!r} is no whole number from 0 to {most}")
    return value
