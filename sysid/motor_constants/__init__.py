"""Torques of logs that have motor currents: motor constants, given or identified."""

from sysid.motor_constants.basis import constants_by_payload, constants_by_urdf
from sysid.motor_constants.constants import (
    MotorConstants,
    given_constants,
    has_currents,
)

__all__ = [
    "MotorConstants",
    "constants_by_payload",
    "constants_by_urdf",
    "given_constants",
    "has_currents",
]
