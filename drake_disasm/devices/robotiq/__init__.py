"""The Robotiq 2F-140 gripper over Modbus: registers as pure functions, a client."""

from drake_disasm.devices.robotiq.client import RobotiqClient, RobotiqSettings
from drake_disasm.devices.robotiq.registers import (
    Activation,
    Command,
    FingerState,
    Status,
    Stroke,
    decode_command,
    decode_status,
    encode_command,
    encode_status,
    fault_words,
)

__all__ = [
    "Activation",
    "Command",
    "FingerState",
    "RobotiqClient",
    "RobotiqSettings",
    "Status",
    "Stroke",
    "decode_command",
    "decode_status",
    "encode_command",
    "encode_status",
    "fault_words",
]
