"""Packets of the Compute Box's UDP protocol, from and to bytes.

Source: OnRobot's example `highspeed_udp.c`, as the GitHub repository
jsbyysheng/onrobot_hex_ft_sensor carries it. All numbers are big-endian.
"""

import dataclasses
import enum
import math
import struct

from drake_disasm.common.errors import DisasmError
from drake_disasm.devices.codec_error import CodecError

#: The box's UDP port.
PORT = 49152

#: Cut-off of the box's low-pass filter [Hz], 0 for none, and its code.
FILTERS = {0.0: 0, 500.0: 1, 150.0: 2, 50.0: 3, 15.0: 4, 5.0: 5, 1.5: 6}

#: Periods between samples [ms]: from 500 Hz down to the slowest seen, 5 Hz.
PERIODS_MS = range(2, 201)

_HEADER = 0x1234
_REQUEST = struct.Struct(">HHI")  # header, command, data
_SAMPLE = struct.Struct(">3I6i")  # hs_sequence, sequence, status, counts
_COUNTS = (10_000,) * 3 + (100_000,) * 3  # per N, per N m
_NUMBERS = 2**32  # that a sequence has before it starts again at 0


class BoxCommand(enum.IntEnum):
    """What a request asks for, and what its data then mean."""

    STOP = 0x0000
    START = 0x0002  # data: how many samples, 0 for endless
    BIAS = 0x0042  # data: 0xFF on, 0 off
    FILTER = 0x0081  # data: a code of FILTERS
    PERIOD = 0x0082  # data: [ms]


@dataclasses.dataclass(frozen=True)
class BoxRequest:
    """What a client sends to the box."""

    command: BoxCommand
    data: int = 0


@dataclasses.dataclass(frozen=True)
class Sample:
    """What the box sends to a client.

    Attributes:
        hs_sequence: number of the datagram, modulo 2^32.
        sequence: number of the sensor's sample, modulo 2^32.
        status: 0 if the sample is good.
        wrench: [f; tau] at the sensor's origin in its axes [N, N m], as reported.
    """

    hs_sequence: int
    sequence: int
    status: int
    wrench: tuple[float, ...]


def filter_request(cutoff: float) -> BoxRequest:
    """Returns the request for a cut-off [Hz] of the box's filter; 0 is none."""
    if cutoff not in FILTERS:
        choices = ", ".join(f"{choice:g}" for choice in FILTERS)
        raise DisasmError(f"HEX: no filter of {cutoff:g} Hz; choose one of {choices}")
    return BoxRequest(BoxCommand.FILTER, FILTERS[cutoff])


def period_request(period: float) -> BoxRequest:
    """Returns the request for a period between samples [s], in whole ms."""
    matches = [ms for ms in PERIODS_MS if math.isclose(1000.0 * period, ms)]
    if not matches:
        raise DisasmError(
            f"HEX: no period of {period:g} s; choose whole milliseconds "
            f"from {PERIODS_MS[0]} to {PERIODS_MS[-1]}"
        )
    return BoxRequest(BoxCommand.PERIOD, matches[0])


def encode_request(request: BoxRequest) -> bytes:
    """Returns the 8 bytes of a request; raises CodecError if it doesn't fit."""
    try:
        return _REQUEST.pack(_HEADER, request.command, request.data)
    except struct.error as error:
        raise CodecError(f"HEX: {request} has no encoding: {error}") from error


def decode_request(datagram: bytes) -> BoxRequest:
    """Returns the request of 8 bytes; raises CodecError if they are none."""
    _check_length(datagram, _REQUEST.size)
    header, command, data = _REQUEST.unpack(datagram)
    if header != _HEADER:
        raise CodecError(f"HEX: a request begins with {header:#06x}, not {_HEADER:#x}")
    try:
        return BoxRequest(BoxCommand(command), data)
    except ValueError as error:
        raise CodecError(f"HEX: command {command:#06x} is unknown") from error


def encode_sample(sample: Sample) -> bytes:
    """Returns the 36 bytes of a sample; raises CodecError if it doesn't fit."""
    numbers = sample.hs_sequence, sample.sequence, sample.status
    try:
        # Not a number, infinite, too large, not six: each raises one of these.
        pairs = zip(sample.wrench, _COUNTS, strict=True)
        return _SAMPLE.pack(*numbers, *(round(value * unit) for value, unit in pairs))
    except (struct.error, ValueError, OverflowError) as error:
        raise CodecError(f"HEX: {sample} has no encoding: {error}") from error


def decode_sample(datagram: bytes) -> Sample:
    """Returns the sample of 36 bytes; raises CodecError if they are none."""
    _check_length(datagram, _SAMPLE.size)
    hs_sequence, sequence, status, *counts = _SAMPLE.unpack(datagram)
    wrench = tuple(count / unit for count, unit in zip(counts, _COUNTS, strict=True))
    return Sample(hs_sequence, sequence, status, wrench)


def sequence_step(before: int, after: int) -> int:
    """Returns the shorter way from one sequence number to another, with its sign."""
    half = _NUMBERS // 2
    return (after - before + half) % _NUMBERS - half


def _check_length(datagram: bytes, length: int) -> None:
    if len(datagram) != length:
        raise CodecError(
            f"HEX: a datagram has {len(datagram)} bytes, not {length}; "
            "does something else send to this port?"
        )
