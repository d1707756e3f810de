"""Orientations in every form become the same unit quaternions."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix

from drake_disasm.common.spatial import pose_to_vector, rotation_vector
from drake_disasm.logs import read_log
from drake_disasm.logs.importing import (
    FieldMap,
    ImportProcessing,
    Known,
    guessed_map,
    import_recordings,
    map_to_fill_in,
    read_source,
    write_log,
)
from drake_disasm.logs.importing.field_map import parse_map
from drake_disasm.logs.importing.orientations import FORMS
from drake_disasm.logs.importing.presets import PRESETS
from drake_disasm.logs.importing.source import Source
from drake_disasm.logs.importing.usage import uses
from drake_disasm.stations.fake_cell.bag import FakeBag
from tests.refusals import refusal

_RPY = np.random.default_rng(3).uniform(-1.5, 1.5, (7, 3))
_ROTATIONS = [RotationMatrix(RollPitchYaw(rpy)) for rpy in _RPY]


def _wxyz(R: RotationMatrix) -> np.ndarray:
    return pose_to_vector(RigidTransform(R, np.zeros(3)))[3:]


_WXYZ = np.array([_wxyz(R) for R in _ROTATIONS])
_FORMS = {
    "quaternion_wxyz": _WXYZ,
    "quaternion_xyzw": -_WXYZ[:, [1, 2, 3, 0]],  # the same rotations
    "rotation_vector": np.array([rotation_vector(R) for R in _ROTATIONS]),
    "roll_pitch_yaw": _RPY,
    "matrix": np.array([R.matrix().ravel() for R in _ROTATIONS]),
}
_WRENCH = ("fx", "fy", "fz", "tx", "ty", "tz")
_READINGS = np.random.default_rng(4).random((7, 6))
_URDF = """<robot name="r"><link name="base"/><link name="arm"/><link name="hand"/>
<joint name="lift" type="prismatic"><parent link="base"/><child link="arm"/>
<axis xyz="0 0 1"/><limit lower="0" upper="1" velocity="1" effort="1"/></joint>
<joint name="turn" type="revolute"><parent link="arm"/><child link="hand"/>
<axis xyz="1 0 0"/><limit lower="-9" upper="9" velocity="1" effort="1"/></joint>
<joint name="mount" type="fixed"><parent link="hand"/><child link="tool0"/>
<origin xyz="0 0 0.3" rpy="0 0 1.2"/></joint><link name="tool0"/></robot>"""


def _readings(path: Path, values: np.ndarray, names: Any = None) -> Source:
    """Writes an orientation with a wrench, and reads it."""
    values = np.asarray(values, dtype=float)
    names = names or [f"o{i}" for i in range(values.shape[1])]
    head = ",".join(["order", *names, *_WRENCH])
    table = np.column_stack([np.arange(len(values)), values, _READINGS[: len(values)]])
    np.savetxt(path, table, "%.17g", ",", header=head, comments="")
    return read_source(path)


def _map(width: int, **column: Any) -> dict[str, Any]:
    """Returns a map of readings whose orientation is in the first channels."""
    channels = [f"o{i}" for i in range(width)]
    return {
        "kind": "static_wrench",
        "order": "order",
        "frames": {"wrench": "S"},
        "columns": {"R_WS": {"from": channels} | column, "wrench": list(_WRENCH)},
    }


def _imported(source: Source, fields: Any) -> Any:
    fields = fields if isinstance(fields, FieldMap) else parse_map(fields)
    [episode] = import_recordings([source], fields, ImportProcessing()).episodes
    return episode["R_WS"]


def _assert_same(wxyz: np.ndarray, expected: np.ndarray, off: float = 1e-12) -> None:
    """Expects the same rotations, whatever the quaternions' signs."""
    assert np.abs(np.sum(wxyz * expected, axis=1)) == pytest.approx(1.0, abs=off)


@pytest.mark.parametrize("form", _FORMS)
def test_every_form_is_the_same_rotation(tmp_path: Path, form: str) -> None:
    path, values = tmp_path / "run.csv", _FORMS[form]
    fields = _map(values.shape[1], **{"as": form})
    _assert_same(_imported(_readings(path, values), fields), _WXYZ)
    rounded = _imported(_readings(path, np.round(values, 2)), fields)
    assert np.linalg.norm(rounded, axis=1) == pytest.approx(1.0, abs=1e-12)
    _assert_same(rounded, _WXYZ, 1e-4)  # 0.02 rad
    if values.shape[1] == 3:
        source = _readings(path, np.degrees(values))
        in_degrees = _map(3, **{"as": form, "unit": "deg"})
        _assert_same(_imported(source, in_degrees), _WXYZ)
        message = refusal(_imported, source, fields)
        assert "has angles of up to" in message and "give `unit: deg`" in message
        in_degrees["columns"]["R_WS"]["unit"] = "mm"
        assert "is in 'mm'" in refusal(_imported, source, in_degrees)


def test_neighbours_can_be_interpolated(tmp_path: Path) -> None:
    """A turn through 180 degrees has no jump in it, nor a row without numbers."""
    angles = np.linspace(2.0, 4.0, 7)[:, None]
    vectors = (angles - 2.0 * np.pi * (angles > np.pi)) * np.array([0.0, 0.6, 0.8])
    source = _readings(tmp_path / "run.csv", vectors)
    found = _imported(source, _map(3, **{"as": "rotation_vector"}))
    half = 0.5 * angles
    expected = np.hstack([np.cos(half), np.sin(half) * np.array([0.0, 0.6, 0.8])])
    np.testing.assert_allclose(found, expected, atol=1e-12)


@pytest.mark.parametrize(
    ("form", "row", "said"),
    [
        ("matrix", np.diag([1.0, 1.0, -1.0]), "a matrix of determinant -1 is no rot"),
        ("matrix", 2.0 * np.eye(3), "a matrix of determinant 8 is no rotation"),
        ("quaternion_wxyz", np.zeros(4), "a quaternion of norm 0 is no rotation"),
        ("quaternion_xyzw", np.ones(4), "of norm 2 is no rotation, in row 1"),
    ],
)
def test_what_is_no_rotation_is_refused(
    tmp_path: Path, form: str, row: np.ndarray, said: str
) -> None:
    values = _FORMS[form].copy()
    values[1] = row.ravel()
    source = _readings(tmp_path / "run.csv", values)
    assert said in refusal(_imported, source, _map(row.size, **{"as": form}))


@pytest.mark.parametrize(
    ("column", "said"),
    [
        ({"from": ["a"] * 4, "as": "quaternion"}, "did you mean 'quaternion_"),
        ({"from": ["a"] * 4, "as": "matrix"}, "R_WS has 4 channels, not 9"),
        ({"from": ["a"] * 2, "as": "joints"}, "R_WS: `frame` names the URDF's frame"),
        ({"from": ["a"] * 4, "frame": "tool0"}, "R_WS: `frame` names the URDF's"),
    ],
)
def test_a_map_of_no_known_form_is_refused(column: dict[str, Any], said: str) -> None:
    fields = {"kind": "static_wrench", "columns": {"R_WS": column}}
    assert said in refusal(parse_map, fields)


def test_only_what_turns_has_a_form() -> None:
    wrench = {"from": list(_WRENCH), "as": "matrix"}
    fields = {"kind": "static_wrench", "columns": {"wrench": wrench}}
    assert "wrench is no orientation" in refusal(parse_map, fields)
    pose = {"from": ["a", "b"], "as": "joints", "frame": "tool0"}
    fields = {"kind": "transitions", "columns": {"X_GB_measured": pose}}
    assert "does not follow from joints" in refusal(parse_map, fields)


def test_a_pose_has_a_position_before_its_orientation(tmp_path: Path) -> None:
    table = {f"c{i}": np.zeros(7) for i in range(6)} | {"t": 0.1 * np.arange(7)}
    position = np.random.default_rng(5).random((7, 3))
    pose = np.hstack([1e3 * position, _FORMS["rotation_vector"]])
    table |= {f"p{i}": pose[:, i] for i in range(6)}
    np.savez(tmp_path / "run.npz", done=np.zeros(7), **table)
    of = {"from": [f"p{i}" for i in range(6)], "as": "rotation_vector", "unit": "mm"}
    zero = [f"c{i}" for i in range(6)]
    columns = {"X_GB_measured": of, "X_GB_commanded": of}
    columns |= dict.fromkeys(("wrench", "action", "ft_sensor"), zero)
    columns |= dict.fromkeys(("terminated", "truncated"), "done")
    fields = parse_map(
        {"kind": "transitions", "time": {"from": "t"}, "columns": columns}
    )
    source = read_source(tmp_path / "run.npz")
    [episode] = import_recordings([source], fields, ImportProcessing()).episodes
    np.testing.assert_allclose(episode["X_GB_measured"][:, :3], position)
    _assert_same(episode["X_GB_measured"][:, 3:], _WXYZ)


def test_orientations_follow_from_joints(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(_URDF)
    turns = np.linspace(-3.0, 3.0, 7)
    source = _readings(tmp_path / "run.csv", np.column_stack([turns, turns]))
    fields = _map(2, **{"as": "joints", "frame": "tool0"})
    arm = {"urdf": str(tmp_path / "arm.urdf"), "joints": ["turn", "lift"]}
    found = import_recordings([source], parse_map(fields | arm), ImportProcessing())
    half = 0.5 * turns[:, None]
    by_x = np.hstack([np.cos(half), np.sin(half), 0.0 * half, 0.0 * half])
    about_x = [RotationMatrix(RollPitchYaw(turn, 0.0, 0.0)) for turn in turns]
    expected = [_wxyz(R @ RotationMatrix.MakeZRotation(1.2)) for R in about_x]
    _assert_same(found.episodes[0]["R_WS"], np.array(expected))
    write_log(found, [source], parse_map(fields | arm), tmp_path / "log", {})
    assert read_log(tmp_path / "log").header.joints == ()

    def said(**change: Any) -> str:
        return refusal(_imported, source, fields | arm | change)

    assert "follows from joints; give the arm's URDF by `urdf`" in said(urdf="")
    assert "no joint 'left'; did you mean 'lift'?" in said(joints=["turn", "left"])
    fields["columns"]["R_WS"]["frame"] = "tool"
    assert "no link or frame 'tool'; did you mean 'tool0'?" in said()
    fields["columns"]["R_WS"] = {"from": ["o0"], "as": "joints", "frame": "hand"}
    assert "1 channels for the URDF's 2 joints (lift, turn)" in said(joints=[])
    turned = _imported(source, fields | arm | {"joints": ["turn"]})
    _assert_same(turned, by_x)  # what is not named is at 0


@pytest.mark.parametrize(
    ("names", "form", "unit"),
    [
        ([f"tcp_rotvec_{axis}" for axis in "xyz"], "rotation_vector", ""),
        (["roll", "pitch", "yaw"], "roll_pitch_yaw", ""),
        ([f"ee/{x} [deg]" for x in ("Roll", "Pitch", "Yaw")], "roll_pitch_yaw", "deg"),
        ([f"R{i}{j}" for i in "123" for j in "123"], "matrix", ""),
        ([f"T.r_{i}_{j}" for i in "012" for j in "012"], "matrix", ""),
        ([f"quaternion.{axis}" for axis in "wxyz"], "quaternion_wxyz", ""),
    ],
)
def test_names_say_the_form(
    tmp_path: Path, names: list[str], form: str, unit: str
) -> None:
    values = np.degrees(_FORMS[form]) if unit else _FORMS[form]
    source = _readings(tmp_path / "run.csv", values, names)
    fields = guessed_map(source, "static_wrench")
    assert fields.columns["R_WS"].channels == tuple(names)
    assert (fields.columns["R_WS"].form, fields.columns["R_WS"].unit) == (form, unit)
    _assert_same(_imported(source, fields), _WXYZ)
    why = uses(source, "static_wrench", fields)[names[0]]
    assert why.startswith(f"R_WS as {form}.0 (its name says ")


def test_three_angles_about_axes_are_not_guessed(tmp_path: Path) -> None:
    source = _readings(tmp_path / "run.csv", _RPY, ["rx", "ry", "rz"])
    message = refusal(guessed_map, source, "static_wrench")
    assert "rx, ry, rz may be a rotation vector or roll, pitch and yaw" in message
    source = _readings(tmp_path / "run.csv", _RPY, ["q_0", "q_1", "q_2"])
    assert "give `as: joints`" in refusal(guessed_map, source, "static_wrench")
    template = map_to_fill_in("static_wrench", source)
    assert yaml.safe_load(template)["frames"] == {"wrench": "S"}
    assert all(form in template for form in FORMS)


def test_a_ur_s_pose_and_force_are_known(tmp_path: Path) -> None:
    names = ["timestamp", *(f"actual_TCP_pose_{i}" for i in range(6))]
    names += [f"actual_TCP_force_{i}" for i in range(6)]
    vectors = _FORMS["rotation_vector"]
    table = np.column_stack([np.arange(7.0), 0.1 * vectors, vectors, _READINGS])
    path = tmp_path / "run.csv"
    np.savetxt(path, table, "%.17g", ",", header=",".join(names), comments="")
    source, known = read_source(path), Known(preset=PRESETS["rtde"])
    fields = guessed_map(source, "static_wrench", known)
    assert fields.frames == {"wrench": "W"}
    _assert_same(_imported(source, fields), _WXYZ)
    assert "in W, as RTDE" in uses(source, "static_wrench", fields)[names[-1]]


def test_joints_of_another_topic_are_interpolated(tmp_path: Path) -> None:
    """Readings of 50 Hz beside joints of 20 Hz, which turn by half a turn and more."""
    (tmp_path / "arm.urdf").write_text(_URDF)
    bag, turn = FakeBag(), 2.0
    for time in np.arange(0.05, 3.0, 0.05):
        state = np.array([0.0, turn * time])
        bag.add_joint_state(time, ("lift", "turn"), state, np.zeros(2))
    for time in np.arange(0.1, 2.9, 0.02):
        bag.add_wrench(time, np.ones(6))
    bag.write(tmp_path / "bag", True)
    source = read_source(tmp_path / "bag")
    joints = [f"/joint_states:position.{name}" for name in ("lift", "turn")]
    wrench = [f"/ft:wrench.{a}.{b}" for a in ("force", "torque") for b in "xyz"]
    fields = {
        "kind": "static_wrench",
        "urdf": str(tmp_path / "arm.urdf"),
        "frames": {"wrench": "S"},
        "columns": {
            "wrench": wrench,
            "R_WS": {"from": joints, "as": "joints", "frame": "hand"},
        },
    }
    [episode] = import_recordings(
        [source], parse_map(fields), ImportProcessing()
    ).episodes
    half = 0.5 * turn * (episode["time"] + 0.1)
    expected = np.column_stack([np.cos(half), np.sin(half), 0.0 * half, 0.0 * half])
    _assert_same(episode["R_WS"], expected, 1e-6)
