"""The OnRobot HEX force/torque sensor, over its Compute Box's UDP protocol."""

from drake_disasm.devices.onrobot_hex.client import HexClient
from drake_disasm.devices.onrobot_hex.codec import (
    BoxCommand,
    BoxRequest,
    Sample,
    decode_request,
    decode_sample,
    encode_request,
    encode_sample,
)

__all__ = [
    "BoxCommand",
    "BoxRequest",
    "HexClient",
    "Sample",
    "decode_request",
    "decode_sample",
    "encode_request",
    "encode_sample",
]
