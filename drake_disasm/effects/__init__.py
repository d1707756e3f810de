"""Physical effects that a scenario can list. To add one: a file and a line here."""

from drake_disasm.effects.base import (
    Effect,
    Environment,
    EnvironmentEffect,
    Sensing,
    SensorEffect,
)
from drake_disasm.effects.groove_friction import GrooveFriction
from drake_disasm.effects.groove_pose import GroovePose
from drake_disasm.effects.payload_error import PayloadError
from drake_disasm.effects.sensor_bias import SensorBias

#: Every effect that a scenario may name, in the order of the documentation.
EFFECTS: tuple[type[Effect], ...] = (
    GroovePose,
    GrooveFriction,
    SensorBias,
    PayloadError,
)

__all__ = [
    "EFFECTS",
    "Effect",
    "Environment",
    "EnvironmentEffect",
    "GrooveFriction",
    "GroovePose",
    "PayloadError",
    "Sensing",
    "SensorBias",
    "SensorEffect",
]
