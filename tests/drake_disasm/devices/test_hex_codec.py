"""The HEX's packets, against bytes written by hand from the protocol."""

import numpy as np
import pytest

from drake_disasm.devices.codec_error import CodecError
from drake_disasm.devices.onrobot_hex import codec
from tests.refusals import refusal

REQUESTS = [
    ("1234 0000 00000000", codec.BoxRequest(codec.BoxCommand.STOP)),
    ("1234 0002 00000000", codec.BoxRequest(codec.BoxCommand.START)),
    ("1234 0002 0000000a", codec.BoxRequest(codec.BoxCommand.START, 10)),
    ("1234 0042 000000ff", codec.BoxRequest(codec.BoxCommand.BIAS, 0xFF)),
    ("1234 0081 00000004", codec.BoxRequest(codec.BoxCommand.FILTER, 4)),
    ("1234 0082 00000002", codec.BoxRequest(codec.BoxCommand.PERIOD, 2)),
]
ZEROS = "00000000" * 4
SAMPLES = [
    (
        "00000001 00000002 00000000"
        "00002710 ffffd8f0 00000001"  # 10000, -10000, 1
        "000186a0 fffe7960 ffffffff",  # 100000, -100000, -1
        codec.Sample(1, 2, 0, (1.0, -1.0, 0.0001, 1.0, -1.0, -0.00001)),
    ),
    (
        "ffffffff 00000000 00000003 7fffffff 80000000" + ZEROS,
        codec.Sample(2**32 - 1, 0, 3, (214748.3647, -214748.3648, 0.0, 0.0, 0.0, 0.0)),
    ),
]
STILL = (0.0,) * 6


@pytest.mark.parametrize(("text", "request_"), REQUESTS)
def test_requests_both_ways(text: str, request_: codec.BoxRequest) -> None:
    assert codec.encode_request(request_) == bytes.fromhex(text)
    assert codec.decode_request(bytes.fromhex(text)) == request_


def test_samples_both_ways() -> None:
    for text, sample in SAMPLES:
        assert codec.encode_sample(sample) == bytes.fromhex(text)
        assert codec.decode_sample(bytes.fromhex(text)) == sample
    rng = np.random.default_rng(0)
    for datagram in (rng.bytes(36) for _ in range(500)):
        assert codec.encode_sample(codec.decode_sample(datagram)) == datagram
    datagram = codec.encode_sample(codec.Sample(0, 0, 0, (0.00019, *STILL[1:])))
    assert codec.decode_sample(datagram).wrench[0] == 0.0002


def test_what_is_no_request_or_sample_is_refused() -> None:
    for text, words in (
        ("1234 0000 000000", "7 bytes, not 8"),
        ("1234 0000 00000000 00", "9 bytes, not 8"),
        ("4321 0000 00000000", "begins with 0x4321"),
        ("1234 0001 00000000", "command 0x0001 is unknown"),
    ):
        with pytest.raises(CodecError, match=words):
            codec.decode_request(bytes.fromhex(text))
    for length in (0, 35, 37):
        with pytest.raises(CodecError, match=f"{length} bytes, not 36"):
            codec.decode_sample(bytes(length))


@pytest.mark.parametrize(
    "sample",
    [
        codec.Sample(0, 0, 0, (np.nan, *STILL[1:])),
        codec.Sample(0, 0, 0, (214748.3648, *STILL[1:])),
        codec.Sample(0, 0, 0, (*STILL[1:], -21474.83649)),
        codec.Sample(0, 0, 0, STILL[1:]),
        codec.Sample(2**32, 0, 0, STILL),
        codec.Sample(0, -1, 0, STILL),
        codec.BoxRequest(codec.BoxCommand.START, -1),
        codec.BoxRequest(codec.BoxCommand.START, 2**32),
    ],
)
def test_what_does_not_fit_is_refused(sample: codec.Sample | codec.BoxRequest) -> None:
    encode = (
        codec.encode_sample
        if isinstance(sample, codec.Sample)
        else codec.encode_request
    )
    with pytest.raises(CodecError, match="no encoding"):
        encode(sample)


def test_settings_and_those_that_the_box_lacks() -> None:
    assert [codec.filter_request(hz).data for hz in codec.FILTERS] == list(range(7))
    assert codec.filter_request(15) == codec.BoxRequest(codec.BoxCommand.FILTER, 4)
    assert codec.period_request(0.002) == codec.BoxRequest(codec.BoxCommand.PERIOD, 2)
    assert codec.period_request(0.2) == codec.BoxRequest(codec.BoxCommand.PERIOD, 200)
    assert "choose one of 0, 500, 150, 50, 15, 5, 1.5" in refusal(
        codec.filter_request, 30
    )
    for period in (0.001, 0.0025, 0.201, np.nan):
        assert "whole milliseconds from 2 to 200" in refusal(
            codec.period_request, period
        )


def test_sequence_numbers_wrap() -> None:
    assert codec.sequence_step(7, 7) == 0
    assert codec.sequence_step(2**32 - 1, 0) == 1
    assert codec.sequence_step(2**32 - 2, 1) == 3
    assert codec.sequence_step(0, 2**32 - 1) == -1
