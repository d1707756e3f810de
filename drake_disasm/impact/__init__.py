"""The thesis's contact law between bolt and groove, and the twin's step with it."""

from drake_disasm.impact.law import ImpactLaw
from drake_disasm.impact.shape import LockShape
from drake_disasm.impact.step import (
    NO_BALANCE,
    ImpactConditions,
    ImpactStep,
    Surroundings,
    turning,
)

__all__ = [
    "NO_BALANCE",
    "ImpactConditions",
    "ImpactLaw",
    "ImpactStep",
    "LockShape",
    "Surroundings",
    "turning",
]
