"""Model-based robotic disassembly on Drake: cell, twin, effects and task."""

__version__ = "0.1.0"
