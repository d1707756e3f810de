"""The gripper's registers: golden frames, bit by bit, and garbage."""

import contextlib
import dataclasses
import math

import numpy as np
import pytest
from pymodbus.framer import FramerRTU
from pymodbus.pdu import DecodePDU
from pymodbus.pdu.register_message import (
    ReadHoldingRegistersResponse,
    WriteMultipleRegistersRequest,
)

from drake_disasm.devices.codec_error import CodecError
from drake_disasm.devices.robotiq import registers as reg

OPEN = reg.Command(activate=True, go=True, speed=255, force=255)

#: Writes, of the manual's examples.
GOLDEN_COMMANDS = {
    "09 10 03 E8 00 03 06 09 00 00 00 FF FF 72 19": OPEN,
    "09 10 03 E8 00 03 06 09 00 00 FF FF FF 42 29": dataclasses.replace(
        OPEN, position=255
    ),
    "09 10 03 E8 00 03 06 00 00 00 00 00 00 73 30": reg.Command(),
    "09 10 03 E8 00 03 06 01 00 00 00 00 00 72 E1": reg.Command(activate=True),
}

CLOSING = reg.Status(
    activated=True,
    going=True,
    state=reg.Activation.DONE,
    object_detected=reg.FingerState.MOVING,
    position_request=0xFF,
    position=0x0E,
    current=0x0A,
)

#: Replies to reads, of the manual's examples: closing, and closed on an object.
GOLDEN_STATUSES = {
    "09 03 06 39 00 00 FF 0E 0A F7 8B": CLOSING,
    "09 03 06 B9 00 00 FF BD 00 1D 7C": dataclasses.replace(
        CLOSING,
        object_detected=reg.FingerState.STOPPED_CLOSING,
        position=0xBD,
        current=0,
    ),
}

#: By register: the bits that mean something.
BITS = ((0x3900, 0x00FF, 0xFFFF), (0xF900, 0xFFFF, 0xFFFF))
CODECS = (
    (reg.encode_command, reg.decode_command),
    (reg.encode_status, reg.decode_status),
)


def test_golden_frames() -> None:
    framer = FramerRTU(DecodePDU(False))
    for golden, command in GOLDEN_COMMANDS.items():
        request = WriteMultipleRegistersRequest(
            address=reg.COMMAND_ADDRESS,
            registers=list(reg.encode_command(command)),
            dev_id=9,
        )
        assert framer.buildFrame(request) == bytes.fromhex(golden)
    for golden, status in GOLDEN_STATUSES.items():
        _, reply = FramerRTU(DecodePDU(False)).handleFrame(bytes.fromhex(golden), 9, 0)
        assert isinstance(reply, ReadHoldingRegistersResponse)
        assert reg.decode_status(reply.registers) == status
        assert reg.encode_status(status) == tuple(reply.registers)


@pytest.mark.parametrize(
    ("value", "registers"),
    [
        (reg.Command(activate=True), (0x0100, 0, 0)),
        (reg.Command(go=True), (0x0800, 0, 0)),
        (reg.Command(automatic_release=True), (0x1000, 0, 0)),
        (reg.Command(release_opens=True), (0x2000, 0, 0)),
        (reg.Command(position=0x81), (0, 0x0081, 0)),
        (reg.Command(speed=0x81), (0, 0, 0x8100)),
        (reg.Command(force=0x81), (0, 0, 0x0081)),
        (reg.Status(activated=True), (0x0100, 0, 0)),
        (reg.Status(going=True), (0x0800, 0, 0)),
        (reg.Status(state=reg.Activation.ACTIVATING), (0x1000, 0, 0)),
        (reg.Status(state=reg.Activation.DONE), (0x3000, 0, 0)),
        (reg.Status(object_detected=reg.FingerState.STOPPED_OPENING), (0x4000, 0, 0)),
        (reg.Status(object_detected=reg.FingerState.STOPPED_CLOSING), (0x8000, 0, 0)),
        (reg.Status(object_detected=reg.FingerState.AT_REQUEST), (0xC000, 0, 0)),
        (reg.Status(fault=0x8E), (0, 0x8E00, 0)),
        (reg.Status(position_request=0x81), (0, 0x0081, 0)),
        (reg.Status(position=0x81), (0, 0, 0x8100)),
        (reg.Status(current=0x81), (0, 0, 0x0081)),
    ],
)
def test_bit_by_bit(
    value: reg.Command | reg.Status, registers: tuple[int, ...]
) -> None:
    is_command = isinstance(value, reg.Command)
    encode, decode = CODECS[0] if is_command else CODECS[1]
    assert encode(value) == registers
    assert decode(registers) == value


def test_reserved_bits_are_ignored_and_undefined_states_refused() -> None:
    assert reg.decode_command((0xC6FF, 0xFF00, 0)) == reg.Command()
    assert reg.decode_status((0x06FF, 0, 0)) == reg.Status()
    with pytest.raises(CodecError, match="gSTA is 2"):
        reg.decode_status((0x2000, 0, 0))


@pytest.mark.parametrize(
    "registers", [(0, 0), (0,) * 4, (-1, 0, 0), (0, 65536, 0), (0, 0, 0.0)]
)
def test_decoding_refuses(registers: tuple) -> None:
    for _, decode in CODECS:
        with pytest.raises(CodecError, match="gripper"):
            decode(registers)


@pytest.mark.parametrize("value", [-1, 256, 0.5])
def test_encoding_refuses(value: int) -> None:
    for name in ("position", "speed", "force"):
        with pytest.raises(CodecError, match="no whole number"):
            reg.encode_command(reg.Command(**{name: value}))
    for name in ("fault", "position_request", "position", "current"):
        with pytest.raises(CodecError, match="no whole number"):
            reg.encode_status(reg.Status(**{name: value}))


def test_random_registers_keep_the_bits_that_mean_something() -> None:
    for registers in np.random.default_rng(0).integers(65536, size=(500, 3)).tolist():
        for (encode, decode), bits in zip(CODECS, BITS, strict=True):
            with contextlib.suppress(CodecError):  # a state that is not defined
                kept = tuple(r & b for r, b in zip(registers, bits, strict=True))
                assert encode(decode(registers)) == kept


def test_openings_and_requests() -> None:
    stroke = reg.Stroke()
    assert stroke.opening(3) == pytest.approx(0.140)
    assert stroke.opening(230) == pytest.approx(0.0)
    assert stroke.opening(0) > 0.140  # wrong echoes show
    openings = [math.inf, 0.140, 0.0, -math.inf]  # clamped
    assert [stroke.request(o) for o in openings] == [0, 0, 255, 255]
    for echo in (4, 50, 229):
        assert stroke.request(stroke.opening(echo)) == echo
    with pytest.raises(CodecError, match="NaN"):
        stroke.request(math.nan)


def test_faults_have_words_and_a_remedy() -> None:
    assert reg.fault_words(0) == ""
    assert "overcurrent" in reg.fault_words(0x0E)
    assert "0x21: not in the manual" in reg.fault_words(0x21)
    assert all(": " in words for words in reg.FAULTS.values())
