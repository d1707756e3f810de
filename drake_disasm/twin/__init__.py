"""The digital twin as functions of arrays: one description, one step, one settling."""

from drake_disasm.twin.contact_step import (
    NO_BALANCE,
    ImpactConditions,
    ImpactStep,
    Surroundings,
    turning,
)
from drake_disasm.twin.law import ImpactLaw
from drake_disasm.twin.shape import LockShape

__all__ = [
    "NO_BALANCE",
    "ImpactConditions",
    "ImpactLaw",
    "ImpactStep",
    "LockShape",
    "Surroundings",
    "turning",
]
