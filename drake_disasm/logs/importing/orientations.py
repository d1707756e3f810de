"""Orientations as recordings have them, made unit quaternions with w first."""

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.multibody.plant import MultibodyPlant
from scipy.spatial.transform import Rotation

from drake_disasm.cell.parsing import add_model
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.quantity import closest
from drake_disasm.common.spatial import pose_to_vector
from drake_disasm.logs.importing.stream import LARGEST
from drake_disasm.logs.importing.units import UNITS, factor

Array = NDArray[np.float64]

_ROUNDING = 0.005  # of a component: one with two decimals is still a rotation's


@dataclasses.dataclass(frozen=True)
class Form:
    """How channels give an orientation.

    Attributes:
        channels: how many; 0 for one a joint.
        to_rotations: of the channels' values (n, channels), SI; None for joints.
        has_angles: whether they are angles.
    """

    channels: int
    to_rotations: Callable[[Array], Rotation] | None
    has_angles: bool = False


#: By the word that a map says. Roll, pitch and yaw are Drake's: Rz(y) Ry(p) Rx(r).
FORMS: Mapping[str, Form] = {
    "quaternion_wxyz": Form(4, lambda x: Rotation.from_quat(np.roll(x, -1, axis=1))),
    "quaternion_xyzw": Form(4, Rotation.from_quat),
    "rotation_vector": Form(3, Rotation.from_rotvec, True),
    "roll_pitch_yaw": Form(3, lambda x: Rotation.from_euler("xyz", x), True),
    "matrix": Form(9, lambda x: Rotation.from_matrix(x.reshape(-1, 3, 3))),
    "joints": Form(0, None, True),
}
USUAL = "quaternion_wxyz"
JOINTS = "joints"


def unit_factors(unit: str, form: str, channels: int, where: str) -> list[float]:
    """Returns how many SI units each channel's unit is.

    A length is that of a pose's position, which comes first, an angle that of angles.

    Args:
        unit: "" for SI.
        form: one of FORMS.
        channels: how many there are.
        where: for messages.

    Raises:
        DisasmError: nothing there has that unit.
    """
    known, size = FORMS[form], factor(unit, where) if unit else 1.0
    positions = channels - known.channels if known.channels else 0
    dimension = UNITS[unit][0] if unit else ""
    is_length = dimension == "length" and positions > 0
    is_angle = dimension == "angle" and known.has_angles
    if unit and not (is_length or is_angle):
        raise DisasmError(
            f"{where}: nothing in {form} is in '{unit}'; leave `unit` out"
        )
    lengths = [size if is_length else 1.0] * positions
    return lengths + [size if is_angle else 1.0] * (channels - positions)


def quaternions(values: Array, form: str, has_unit: bool, where: str) -> Array:
    """Returns unit quaternions (n, 4), from row to row on the same side.

    Rows without numbers are NaN.

    Args:
        values: (n, channels) of the form, SI.
        form: one of FORMS other than joints.
        has_unit: whether the user said the unit of angles.
        where: for messages.

    Raises:
        DisasmError: a row is no rotation, or angles are in degrees.
    """
    rows = np.flatnonzero((np.abs(values) < LARGEST).all(axis=1))
    found = np.full((len(values), 4), np.nan)
    convert = FORMS[form].to_rotations
    assert convert is not None
    if FORMS[form].has_angles:
        check_angles(values[rows], has_unit, where)
    _check_rotations(values[rows], form, rows, where)
    if len(rows):
        found[rows] = _one_side(np.roll(convert(values[rows]).as_quat(), 1, axis=1))
    return found


def check_angles(values: Array, has_unit: bool, where: str) -> None:
    """Refuses angles beyond a turn whose unit nobody said.

    Raises:
        DisasmError: there are some.
    """
    most = float(np.abs(values).max(initial=0.0))
    if most > 2.0 * math.pi and not has_unit:
        raise DisasmError(
            f"{where}: has angles of up to {most:.4g} rad; give `unit: deg`, or "
            "`unit: rad` if that is right"
        )


def _check_rotations(
    values: Array, form: str, rows: NDArray[np.int64], where: str
) -> None:
    """Refuses what is no rotation, beyond rounding to two decimals."""
    if form == "matrix":
        R = values.reshape(-1, 3, 3)
        off = np.abs(np.swapaxes(R, -1, -2) @ R - np.eye(3)).max(axis=(1, 2))
        size = np.linalg.det(R)
        bad = (off > 2.0 * math.sqrt(3.0) * _ROUNDING) | (size < 0.0)
        what, way = "matrix of determinant", "name its nine channels row by row"
    elif form.startswith("quaternion"):
        size = np.linalg.norm(values, axis=1)
        bad = np.abs(size - 1.0) > math.sqrt(4.0) * _ROUNDING
        what, way = "quaternion of norm", "name the four channels of a unit quaternion"
    else:
        return
    if bad.any():
        first = int(np.argmax(bad))
        raise DisasmError(
            f"{where}: a {what} {size[first]:.4g} is no rotation, in row "
            f"{rows[first]} (the first is 0); {way}, or leave that row out"
        )


def _one_side(wxyz: Array) -> Array:
    """Returns quaternions (n, 4) with signs so that neighbours can be interpolated."""
    first = np.copysign(1.0, wxyz[:1, 0])
    products = np.sum(wxyz[1:] * wxyz[:-1], axis=1)
    signs = np.cumprod(np.concatenate([first, np.where(products < 0.0, -1.0, 1.0)]))
    return wxyz * signs[:, None]


def normalised(values: Array) -> Array:
    """Returns rotations (n, 4), or poses (n, 7), with unit quaternions at their end."""
    norm = np.linalg.norm(values[:, -4:], axis=1, keepdims=True)
    return np.concatenate([values[:, :-4], values[:, -4:] / norm], axis=1)


def frame_poses(q: Array, urdf: str, joints: Sequence[str], frame: str) -> Array:
    """Returns poses (n, 7) of an arm's frame in the world; NaN in rows without numbers.

    By Drake's forward kinematics; the joints that are not named are at 0.

    Args:
        q: (n, joints).
        urdf: of the arm.
        joints: names, in the order of q.
        frame: a link, or a frame.

    Raises:
        DisasmError: the URDF lacks a joint or the frame.
    """
    plant = MultibodyPlant(0.0)
    instance = add_model(plant, urdf)
    plant.Finalize()
    known = [plant.get_joint(i) for i in plant.GetJointIndices(instance)]
    by_name = {j.name(): j.position_start() for j in known if j.num_positions() == 1}
    columns = [_named(by_name, name, f"{urdf}: has no joint") for name in joints]
    frames = [plant.get_frame(i) for i in plant.GetFrameIndices(instance)]
    own = _named({f.name(): f for f in frames}, frame, f"{urdf}: has no link or frame")
    context = plant.CreateDefaultContext()
    positions, found = plant.GetPositions(context), np.full((len(q), 7), np.nan)
    rows = np.flatnonzero((np.abs(q) < LARGEST).all(axis=1))
    for row in rows:
        positions[columns] = q[row]
        plant.SetPositions(context, positions)
        found[row] = pose_to_vector(own.CalcPoseInWorld(context))
    found[rows, 3:] = _one_side(found[rows, 3:])
    return found


def _named(known: Mapping[str, Any], name: str, what: str) -> Any:
    if name not in known:
        raise DisasmError(f"{what} '{name}'; {closest(name, list(known))}")
    return known[name]
