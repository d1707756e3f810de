"""A station finds out by its own experiments what its model lacks."""

from sysid.diagnosis.arm_log import Arm, GrowingArmLog, arm_of_station
from sysid.diagnosis.arm_subject import diagnose_arm
from sysid.diagnosis.design import Prediction, predict
from sysid.diagnosis.diagnose import diagnose
from sysid.diagnosis.growing_log import GrowingLog
from sysid.diagnosis.in_contact import forecasts_as_it_is, twin_forecasts
from sysid.diagnosis.loop import Budget, Diagnosis, Round
from sysid.diagnosis.rivals import NOTHING, Need, Rival, TwinRival

__all__ = [
    "NOTHING",
    "Arm",
    "Budget",
    "Diagnosis",
    "GrowingArmLog",
    "GrowingLog",
    "Need",
    "Prediction",
    "Rival",
    "Round",
    "TwinRival",
    "arm_of_station",
    "diagnose",
    "diagnose_arm",
    "forecasts_as_it_is",
    "predict",
    "twin_forecasts",
]
