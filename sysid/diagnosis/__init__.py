"""A station finds out by its own experiments what its model lacks."""

from sysid.diagnosis.diagnose import Budget, Diagnosis, Round, diagnose
from sysid.diagnosis.rivals import NOTHING, Rival

__all__ = ["NOTHING", "Budget", "Diagnosis", "Rival", "Round", "diagnose"]
