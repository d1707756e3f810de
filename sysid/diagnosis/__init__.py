"""A station finds out by its own experiments what its model lacks."""

from sysid.diagnosis.design import Prediction, predict
from sysid.diagnosis.diagnose import Budget, Diagnosis, Round, diagnose
from sysid.diagnosis.growing_log import GrowingLog
from sysid.diagnosis.rivals import NOTHING, Need, Rival

__all__ = [
    "NOTHING",
    "Budget",
    "Diagnosis",
    "GrowingLog",
    "Need",
    "Prediction",
    "Rival",
    "Round",
    "diagnose",
    "predict",
]
