"""KUKA LBR iiwa behind drake-iiwa-driver, by LCM."""

from drake_disasm.devices.iiwa.command import encode_command
from drake_disasm.devices.iiwa.status import IiwaStatusMonitor

__all__ = ["IiwaStatusMonitor", "encode_command"]
