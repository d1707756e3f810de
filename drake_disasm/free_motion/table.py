"""A motion as a table of joint positions over time."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydrake.multibody.plant import MultibodyPlant

from drake_disasm.cell.arm_model import add_arm
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import read_bytes
from drake_disasm.logs.tables import MOST_BYTES, read_table
from drake_disasm.scenario import ArmConfig

_REMEDY = "give a table as drake-disasm excite writes it: time, q.0, q.1, ... in SI"


@dataclass(frozen=True)
class MotionTable:
    """Where the joints are to be, row by row.

    Attributes:
        time: (n,) increasing, from 0 [s].
        q: (n, joints) positions [rad].
    """

    time: np.ndarray
    q: np.ndarray


def read_motion(path: Path, joints: int) -> MotionTable:
    """Returns the motion of a CSV file with the columns time and q.0, q.1, ...

    Args:
        path: of the file; it may have other columns.
        joints: of the arm.

    Raises:
        DisasmError: it is missing or no table, lacks a column, has a value that is no
            number, fewer than two rows, or time that does not increase.
    """
    names = ["time", *(f"q.{i}" for i in range(joints))]
    table = read_table(read_bytes(path, _REMEDY, MOST_BYTES), path, ())
    for name in names:
        if name not in table:
            raise DisasmError(f"{path}: has no column '{name}'; {_REMEDY}")
    values = np.column_stack([table[name] for name in names])
    if len(values) < 2 or not np.isfinite(values).all():
        raise DisasmError(f"{path}: fewer than two rows, or an empty cell; {_REMEDY}")
    time = values[:, 0]
    if not (np.diff(time) > 0.0).all():
        row = int(np.argmin(np.diff(time) > 0.0)) + 3  # the first line has the names
        raise DisasmError(f"{path}: time does not increase at line {row}; sort it")
    return MotionTable(time - time[0], values[:, 1:])


def refuse_beyond_limits(motion: MotionTable, arm: ArmConfig, source: Path) -> None:
    """Refuses a motion that leaves the joints' ranges or is faster than they can be.

    Args:
        motion: to be played.
        arm: whose model states the limits.
        source: of the motion, for the message.

    Raises:
        DisasmError: names the first joint.
    """
    plant = MultibodyPlant(0.0)
    add_arm(plant, arm)
    plant.Finalize()
    rate = np.diff(motion.q, axis=0) / np.diff(motion.time)[:, None]
    for what, unit, values, low, high in (
        (
            "goes",
            "rad",
            motion.q,
            plant.GetPositionLowerLimits(),
            plant.GetPositionUpperLimits(),
        ),
        (
            "moves",
            "rad/s",
            rate,
            plant.GetVelocityLowerLimits(),
            plant.GetVelocityUpperLimits(),
        ),
    ):
        for i in np.flatnonzero(((values < low) | (values > high)).any(axis=0)):
            worst = values[np.argmax(np.abs(values[:, i])), i]
            raise DisasmError(
                f"{source}: q.{i} {what} at {worst:.3g} {unit}, beyond {low[i]:.3g} to "
                f"{high[i]:.3g}; make the motion smaller or slower"
            )
