"""Units that recordings come in, as factors to SI."""

import math
from collections.abc import Mapping

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.quantity import closest

#: LeRobot's -100 to 100 of a motor's calibrated range, or 0 to 100 of a gripper's.
NORMALISED = "normalised"

#: By name: the dimension, and how many SI units it is.
UNITS: Mapping[str, tuple[str, float]] = {
    "s": ("time", 1.0),
    "ms": ("time", 1e-3),
    "us": ("time", 1e-6),
    "ns": ("time", 1e-9),
    "m": ("length", 1.0),
    "mm": ("length", 1e-3),
    "um": ("length", 1e-6),
    "rad": ("angle", 1.0),
    "mrad": ("angle", 1e-3),
    "deg": ("angle", math.pi / 180.0),
    "°": ("angle", math.pi / 180.0),
    "rev": ("angle", 2.0 * math.pi),
    "rad/s": ("angular velocity", 1.0),
    "deg/s": ("angular velocity", math.pi / 180.0),
    "rpm": ("angular velocity", math.pi / 30.0),
    "m/s": ("velocity", 1.0),
    "mm/s": ("velocity", 1e-3),
    "rad/s^2": ("angular acceleration", 1.0),
    "deg/s^2": ("angular acceleration", math.pi / 180.0),
    "m/s^2": ("acceleration", 1.0),
    "N": ("force", 1.0),
    "mN": ("force", 1e-3),
    "kN": ("force", 1e3),
    "N*m": ("torque", 1.0),
    "Nm": ("torque", 1.0),
    "N m": ("torque", 1.0),
    "N·m": ("torque", 1.0),
    "N.m": ("torque", 1.0),
    "N*mm": ("torque", 1e-3),
    "Nmm": ("torque", 1e-3),
    "mN*m": ("torque", 1e-3),
    "mNm": ("torque", 1e-3),
    "kNm": ("torque", 1e3),
    "A": ("current", 1.0),
    "1": ("none", 1.0),
    "%": ("none", 0.01),
}


def factor(unit: str, where: str) -> float:
    """Returns how many SI units a unit is.

    Raises:
        DisasmError: it is not known.
    """
    if unit == NORMALISED:
        raise DisasmError(
            f"{where}: is in LeRobot's normalised units; give its file of calibration "
            "by `calibration`, or `calibration` degrees if it recorded these"
        )
    if unit not in UNITS:
        raise DisasmError(
            f"{where}: unit '{unit}' is not known; {closest(unit, list(UNITS))}; or "
            "leave it out and give the factor as scale"
        )
    return UNITS[unit][1]
