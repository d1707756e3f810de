"""Model-based robotic disassembly on Drake: cell, twin, effects and task."""

from drake_disasm.learning.registration import register_environments

__version__ = "0.1.0"

register_environments()
