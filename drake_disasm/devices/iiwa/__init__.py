"""KUKA LBR iiwa behind drake-iiwa-driver, by LCM."""

from drake_disasm.devices.iiwa.command import encode_command
from drake_disasm.devices.iiwa.command_channel import CommandChannel
from drake_disasm.devices.iiwa.command_monitor import CommandMonitor
from drake_disasm.devices.iiwa.estimated_wrench import EstimatedWrench
from drake_disasm.devices.iiwa.status import IiwaStatusMonitor

__all__ = [
    "CommandChannel",
    "CommandMonitor",
    "EstimatedWrench",
    "IiwaStatusMonitor",
    "encode_command",
]
