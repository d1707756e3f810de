"""LeRobot's normalised positions as angles, by the calibration of its motors.

A motor with the calibrated range [a, b] of its encoder's steps is recorded as -100 at a
and 100 at b; a gripper as 0 at a and 100 at b (lerobot/motors/motors_bus.py). So an
angle is half the range, or the range, times a hundredth of that, and zero in the middle
of the range, or where the gripper is closed. Whether the URDF has its zero there the
calibration doesn't say.
"""

import dataclasses
import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import read_text
from drake_disasm.common.text import clipped
from drake_disasm.logs.importing.field_map import Column, FieldMap
from drake_disasm.logs.importing.source import Source
from drake_disasm.logs.importing.units import NORMALISED
from drake_disasm.logs.importing.vocabulary import matched, tokens_of

_MOST_BYTES = 2**20
_MOST_STEPS = 2**32
_STEP = 2.0 * math.pi / 4096.0  # rad, of the encoders of Feetech's and Dynamixel's
_REMEDY = "give what LeRobot's calibration wrote, .../calibration/robots/TYPE/ID.json"
_GRIPPER = "gripper"  # the motor whose range LeRobot counts from 0 to 100


def calibrated(fields: FieldMap, source: Source, path: str) -> FieldMap:
    """Returns a map whose normalised columns are angles.

    Args:
        fields: the map.
        source: its recording, whose metadata name the motors.
        path: of the calibration; "degrees" where the recording has these.

    Raises:
        DisasmError: the file is not one, or lacks a motor.
    """
    known = {} if path == "degrees" else _read(Path(path))
    columns = {
        name: _degrees(column) if path == "degrees" else _angles(column, source, known)
        for name, column in fields.columns.items()
        if column.unit == NORMALISED
    }
    if not columns:
        raise DisasmError(
            "`calibration` is given, but nothing is in LeRobot's normalised units; "
            "leave it out, or give `preset` lerobot"
        )
    return dataclasses.replace(fields, columns={**fields.columns, **columns})


def _degrees(column: Column) -> Column:
    return dataclasses.replace(column, unit="deg")


def _angles(column: Column, source: Source, known: Mapping[str, float]) -> Column:
    """Returns positions in rad per hundredth of the motors' ranges."""
    scales = []
    for channel in column.channels:
        label = source.stream_of(channel).labels.get(channel, channel)
        name = label.removesuffix(".pos").rpartition(".")[2]
        order, _ = matched([name], [tokens_of(motor) for motor in known])
        if not order:
            raise DisasmError(
                f"calibration: has no motor '{clipped(name)}'; it has "
                f"{clipped(', '.join(known))}; {_REMEDY}"
            )
        scales.append(list(known.values())[order[0]])
    return dataclasses.replace(column, unit="rad", scales=tuple(scales))


def _read(path: Path) -> dict[str, float]:
    """Returns the angle [rad] that 1 is of each motor, by its name."""
    try:
        raw: Any = json.loads(read_text(path, _REMEDY, _MOST_BYTES))
    except (ValueError, RecursionError):
        raise DisasmError(f"{path}: is not JSON; {_REMEDY}") from None
    found = dict[str, float]()
    for name, motor in raw.items() if isinstance(raw, dict) else ():
        own = motor if isinstance(motor, dict) else {}
        span = _span(own.get("range_min"), own.get("range_max"))
        if not span:
            raise DisasmError(
                f"{path}: motor '{clipped(str(name))}' has no range; {_REMEDY}"
            )
        share = 1.0 if name.rpartition("_")[2] == _GRIPPER else 0.5
        found[str(name)] = share * span * _STEP / 100.0
    if not found:
        raise DisasmError(f"{path}: has no motors; {_REMEDY}")
    return found


def _span(first: object, last: object) -> int:
    """Returns how many steps are between the ends of a range; 0 for no range."""
    if not (isinstance(first, int) and isinstance(last, int)):
        return 0
    return last - first if 0 < last - first < _MOST_STEPS else 0
