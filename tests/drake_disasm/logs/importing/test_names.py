"""Which channel is which: names, metadata, presets and units of other programs."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow  # type: ignore[import-untyped]
import pyarrow.parquet  # type: ignore[import-untyped]
import pytest

from drake_disasm.logs.importing import (
    ImportProcessing,
    Known,
    guessed_map,
    import_recordings,
    read_source,
)
from drake_disasm.logs.importing.field_map import FieldMap
from drake_disasm.logs.importing.lerobot import calibrated
from drake_disasm.logs.importing.presets import PRESETS
from drake_disasm.logs.importing.source import Source
from drake_disasm.logs.importing.usage import uses, without_torques
from drake_disasm.logs.importing.vocabulary import matched, tokens_of
from drake_disasm.logs.schema import WRENCH
from tests.refusals import refusal

_TIME = 0.01 * np.arange(400)
_Q = np.stack([np.sin(k * _TIME + k) for k in range(1, 7)], axis=1)


def _table(path: Path, **columns: Any) -> Source:
    """Writes named columns as CSV and reads them."""
    names = [name.replace("__", " ") for name in columns]
    table = np.column_stack(list(columns.values()))
    np.savetxt(path, table, "%.9g", ",", header=",".join(names), comments="")
    return read_source(path)


def _guess(source: Source, kind: str = "joint_motion", **known: Any) -> FieldMap:
    return guessed_map(source, kind, Known(**known))


@pytest.mark.parametrize(
    ("joint", "name"),
    [
        ("elbow_joint", "elbow_joint"),
        ("elbow_joint", "elbow"),
        ("elbow_joint", "ur10e/Elbow-Joint"),
        ("left_arm_elbow_joint", "elbow_joint"),
        ("lbr_A1", "- A1"),
        ("joint_2", "Joint2"),
        ("iiwa_joint_2", "joint 2"),
    ],
)
def test_prefixes_and_marks_are_no_part_of_a_name(joint: str, name: str) -> None:
    known = [tokens_of("wrist"), tokens_of(name)]
    assert matched([joint], known) == ([1], [])


def test_a_number_alone_is_no_name() -> None:
    names = [tokens_of(f"joint{i}") for i in (1, 2, 3)]
    assert matched(["wrist_1_joint", "wrist_2_joint"], names)[0] == []


@pytest.mark.parametrize(
    ("before", "wrench"),
    [
        ("", "fx fy fz tx ty tz"),
        ("F_ext_", "Fx Fy Fz Mx My Mz"),
        ("ati/", "force_x force_y force_z torque_x torque_y torque_z"),
    ],
)
def test_wrenches_are_known_by_many_names(
    tmp_path: Path, before: str, wrench: str
) -> None:
    names = [f"{before}{name}" for name in wrench.split()]
    names += [f"tool_orientation_{axis}" for axis in "xyzw"]
    columns = {name: np.full(9, k) for k, name in enumerate(names)}
    fields = _guess(_table(tmp_path / "run.csv", **columns), "static_wrench")
    assert fields.columns["wrench"].channels == tuple(names[:6])
    assert fields.columns["R_WS"].channels == (names[9], *names[6:9])


def test_joints_are_matched_by_name_whatever_their_order(tmp_path: Path) -> None:
    source = _table(
        tmp_path / "run.csv",
        **{
            "t": _TIME,
            "-__b_joint_position": _Q[:, 0],
            "-__a_joint_position": _Q[:, 1],
        },
        **{"-__a_joint_effort": _Q[:, 2], "-__b_joint_effort": _Q[:, 3]},
    )
    fields = _guess(source, joints=["a_joint", "b_joint"])
    assert fields.columns["q"].channels == ("- a_joint_position", "- b_joint_position")
    assert fields.columns["tau"].channels == ("- a_joint_effort", "- b_joint_effort")
    assert _guess(source).joints == ("b_joint", "a_joint")  # as recorded
    # Without a match no order is guessed; the user may say that it is the same.
    message = refusal(_guess, source, joints=["x", "y"])
    assert "(b_joint, a_joint) are not x, y; give `joints`" in message
    fields = _guess(source, joints=["x", "y"], in_order=True)
    assert fields.columns["tau"].channels == ("- b_joint_effort", "- a_joint_effort")


def test_given_joints_are_in_order_though_some_names_match(tmp_path: Path) -> None:
    columns = {
        f"position.{n}": _Q[:, i] for i, n in enumerate(("base", "elbwo", "hand"))
    }
    source = _table(tmp_path / "run.csv", t=_TIME, **columns)
    message = refusal(_guess, source, joints=["base", "elbow", "hand"])
    assert "give `joints`" in message
    fields = _guess(source, joints=["base", "elbow", "hand"], in_order=True)
    assert fields.columns["q"].channels == tuple(columns)
    assert fields.joints == ("base", "elbow", "hand")
    message = refusal(_guess, source, joints=["hand", "elbow", "base"], in_order=True)
    assert "'hand' is number 1 of `joints`, and 3 of the recording's" in message


@pytest.mark.parametrize(
    ("names", "units"),
    [
        (("time_ms", "position_deg", "torque_Nm"), ("ms", "deg", "Nm")),
        (("t_us", "pos_rad", "torque_mnm"), ("us", "rad", "mNm")),
        (("Time__(s)", "Angle__(deg)", "Motor__torque__(Nm)"), ("s", "deg", "Nm")),
        (("time", "position_m", "force_N"), ("s", "m", "N")),
        (("time", "tau_m", "q"), ("s", "", "")),
        (("time", "q1_deg", "tau1_Nm"), ("s", "deg", "Nm")),
    ],
)
def test_units_at_the_end_of_a_name_are_units(
    tmp_path: Path, names: tuple[str, ...], units: tuple[str, ...]
) -> None:
    source = _table(tmp_path / "run.csv", **dict(zip(names, _Q.T, strict=False)))
    fields = _guess(source)
    found = [fields.columns[n].unit for n in ("q", "tau")]
    assert [fields.time_unit, *found] == list(units) and fields.joints == ("joint_0",)


def test_a_letter_beside_others_is_a_joint_s(tmp_path: Path) -> None:
    names = {"position_l": _Q[:, 0], "position_m": _Q[:, 1]}
    assert _guess(_table(tmp_path / "run.csv", t=_TIME, **names)).joints == ("l", "m")


def test_a_structure_s_time_is_no_position(tmp_path: Path) -> None:
    def _record(late: float) -> Source:
        names = {"q.time": _TIME, "q.signals.values": _Q[:, 0]}
        names |= {"tau.time": _TIME + late, "tau.signals.values": _Q[:, 1]}
        return _table(tmp_path / "run.csv", **names)

    fields = _guess(_record(0.0), preset=PRESETS["matlab"])
    assert fields.time == "q.time" and fields.joints == ("joint_0",)
    assert set(fields.columns) == {"q", "tau"}
    assert "called as time is" in refusal(_guess, _record(0.5))


def test_what_is_left_out_is_named_where_it_is_missed(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    good, bad = [f"{0.01 * i},{i % 7}" for i in range(40)], ["x"] * 40
    rows = [f"{a},{b}\n" for a, b in zip(good, bad, strict=True)]
    for names, said in (
        ("tau1,time,q1", "as joint positions are: 'q1' holds text"),
        ("q1,tau1,time", "`rate`): 'time' holds text"),
        ("time,q,q", "as joint positions are: 'q' names 2 columns: rename one"),
    ):
        path.write_text(f"{names}\n" + "".join(rows))
        assert said in refusal(_guess, read_source(path))
    path.write_text("time,q1,tau1\n" + "".join(rows))
    source = read_source(path)
    message = refusal(import_recordings, [source], _guess(source), ImportProcessing())
    assert "torques that are not in the map: 'tau1' holds text" in message


def test_the_kind_that_fits_is_said(tmp_path: Path) -> None:
    names = ["order", "qw", "qx", "qy", "qz", *WRENCH]
    columns = {name: np.arange(5.0) + k for k, name in enumerate(names)}
    message = refusal(_guess, _table(tmp_path / "run.csv", **columns))
    assert "its channels are those of `kind` static_wrench" in message
    columns = {"t": _TIME, "q": _Q[:, 0], "goal_position": _Q[:, 1]}
    source = _table(tmp_path / "run.csv", **columns)
    assert "`kind` joint_response" in without_torques(source, _guess(source))


def test_names_that_match_twice_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    source = _table(path, t=_TIME, position_a=_Q[:, 0], a_position=_Q[:, 1])
    assert "are both the position of 'a'" in refusal(_guess, source)
    source = _table(path, t=_TIME, position_l_a=_Q[:, 0], position_r_a=_Q[:, 1])
    message = refusal(_guess, source, joints=["a", "b"])
    assert "joint 'a' is matched twice, by l_a and r_a" in message


def _dataset(path: Path) -> Source:
    """Writes a LeRobot dataset of two motors and a gripper, normalised."""
    (path / "meta").mkdir(parents=True)
    (path / "data").mkdir()
    names = [f"{name}.pos" for name in ("pan", "lift", "gripper")]
    features = {n: {"names": names} for n in ("action", "observation.state")}
    features["observation.images.top"] = {"dtype": "video", "names": []}  # type: ignore[dict-item]
    (path / "meta/info.json").write_text(json.dumps({"features": features}))
    state = 50.0 * _Q[:, :3]
    table = {"timestamp": _TIME, "observation.state": state.tolist()}
    table |= {"action": (state + 1.0).tolist()}
    pyarrow.parquet.write_table(pyarrow.table(table), path / "data/a.parquet")
    return read_source(path)


def test_lerobot_s_names_and_units_are_its_metadata_s(tmp_path: Path) -> None:
    source = _dataset(tmp_path / "set")
    joints = ["gripper", "lift", "pan"]
    fields = _guess(source, "joint_response", joints=joints)
    channels = tuple(f"observation.state.{i}" for i in (2, 1, 0))
    assert fields.columns["q"].channels == channels
    assert "observation.images.top" in source.streams[0].left_out
    message = refusal(import_recordings, [source], fields, ImportProcessing())
    assert "normalised units; give its file of calibration" in message
    motor = {"range_min": 1000, "range_max": 3048}  # half a turn
    path = tmp_path / "arm.json"
    path.write_text(json.dumps(dict.fromkeys(joints, motor)))
    known = calibrated(fields, source, str(path))
    [episode] = import_recordings([source], known, ImportProcessing()).episodes
    # 100 is a quarter of a turn from the middle, and half a turn of a gripper.
    expected = 0.5 * _Q[:, [2, 1, 0]] * np.pi * np.array([1.0, 0.5, 0.5])
    np.testing.assert_allclose(episode["q"], expected, atol=1e-12)
    degrees = calibrated(fields, source, "degrees")
    assert degrees.columns["q_commanded"].unit == "deg"


def test_a_calibration_that_does_not_fit_is_refused(tmp_path: Path) -> None:
    source, path = _dataset(tmp_path / "set"), tmp_path / "arm.json"
    fields = _guess(source, "joint_response")
    for text, said in (
        ("{", "is not JSON"),
        ("[]", "has no motors"),
        ('{"pan": {"range_min": 5, "range_max": 5}}', "motor 'pan' has no range"),
        ('{"pan": {"range_min": 5, "range_max": 9}}', "has no motor 'lift'"),
    ):
        path.write_text(text)
        assert said in refusal(calibrated, fields, source, str(path))
    plain = FieldMap("joint_motion", {})
    assert "nothing is in LeRobot's" in refusal(calibrated, plain, source, str(path))


def _ur(path: Path, swap: bool = False, blocks: int = 5) -> Source:
    """Writes what RTDE recorded, without names; i = tau / k, and friction of 0.3 A."""
    v = np.gradient(_Q, _TIME, axis=0)
    tau = 10.0 * np.cos(_Q)
    i = tau / np.arange(8.0, 14.0) + 0.3 * np.sign(v)
    columns = [_TIME[:, None], *((v, _Q) if swap else (_Q, v)), i + 0.01, i, tau]
    np.savetxt(path, np.column_stack(columns[: blocks + 1]), "%.9g", ",")
    return PRESETS["rtde"].labelled(read_source(path))


def test_a_ur_s_table_without_names_has_its_controller_s_constants(
    tmp_path: Path,
) -> None:
    preset, path = PRESETS["rtde"], tmp_path / "run.csv"
    fields = _guess(_ur(path), preset=preset, joints=[f"ur_{j}" for j in preset.joints])
    assert fields.columns["q"].channels == tuple(f"column_{i}" for i in range(1, 7))
    assert fields.joints[0] == "ur_shoulder_pan_joint"
    np.testing.assert_allclose(
        fields.columns["tau"].scales, np.arange(8, 14), rtol=1e-2
    )
    source = _ur(path, blocks=3)
    fields = _guess(source, preset=preset)
    assert "tau" not in fields.columns and fields.columns["current"].unit == "A"
    [episode] = import_recordings([source], fields, ImportProcessing()).episodes
    assert "current" in episode and "tau" not in episode
    message = refusal(_ur, path, swap=True)
    assert "preset 'rtde' does not fit: column 7 is not the velocity" in message


@pytest.mark.parametrize(
    ("preset", "names", "unit", "sign"),
    [
        ("libfranka", ("time", "state.q[{}]", "state.tau_J[{}]"), "ms", 1.0),
        ("fri", ("time", "mp{}", "mt{}"), "s", -1.0),
        ("matlab", ("run.t", "run.q.signals.values.{}", "run.tau.data.{}"), "s", 1.0),
        ("rtde", ("timestamp", "actual_q_{}", "joint_torque_{}"), "s", 1.0),
    ],
)
def test_presets_know_names_units_and_signs(
    tmp_path: Path, preset: str, names: tuple[str, str, str], unit: str, sign: float
) -> None:
    time, q, tau = names
    columns = {time: _TIME}
    columns |= {q.format(i + 1): _Q[:, i] for i in range(6)}
    columns |= {tau.format(i + 1): _Q[:, i] for i in range(6)}
    source = _table(tmp_path / "run.csv", **columns)
    fields = _guess(source, preset=PRESETS[preset])
    assert (fields.time, fields.time_unit) == (time, unit)
    assert fields.columns["q"].channels == tuple(q.format(i) for i in range(1, 7))
    assert fields.columns["tau"].factors({}, "tau") == [sign] * 6


def test_a_preset_that_does_not_fit_is_refused(tmp_path: Path) -> None:
    source = _table(tmp_path / "run.csv", t=_TIME, q_0=_Q[:, 0], q_1=_Q[:, 1])
    for preset in ("rtde", "lerobot"):
        message = refusal(_guess, source, preset=PRESETS[preset])
        assert f"preset '{preset}' does not fit" in message
    np.savetxt(tmp_path / "bare.csv", _Q[:, :4], delimiter=",")
    bare = read_source(tmp_path / "bare.csv")
    assert "has 4 columns" in refusal(PRESETS["rtde"].labelled, bare)


def test_every_channel_has_a_use_or_a_reason(tmp_path: Path) -> None:
    columns = {"t": _TIME, "q_0": _Q[:, 0], "tau_0": _Q[:, 1], "dq_0": _Q[:, 2]}
    columns |= {"i_0": _Q[:, 3], "lamp": 0.0 * _TIME, "n": np.arange(400.0)}
    source = _table(tmp_path / "run.csv", **columns)
    found = uses(source, "joint_motion", _guess(source))
    assert found["t"] == "time" and found["q_0"] == "q, joint_0"
    assert "made from the positions" in found["dq_0"]
    assert "`current`" in found["i_0"] and "says nothing" in found["lamp"]
    assert "as a time or a count" in found["n"]
    assert uses(source, "joint_motion")["q_0"].startswith("not used: q by its name")


def _rests(path: Path, **clock: Any) -> Source:
    names = {f"q{i}": _Q[:20, i] for i in range(2)}
    return _table(path, **clock, **names, **{f"tau{i}": _Q[:20, i + 2] for i in (0, 1)})


@pytest.mark.parametrize(
    ("clock", "channel", "unit"),
    [
        ({"order": np.arange(20)}, "order", "1"),
        ({}, None, "1"),
        ({"time": 7.0 * np.arange(20)}, "time", "s"),  # rests are seconds apart
        ({"time": 7000.0 * np.arange(20)}, "time", "ms"),
    ],
    ids=["order", "order of the table", "seconds", "milliseconds"],
)
def test_torques_at_rest_are_guessed_with_times_or_an_order(
    tmp_path: Path, clock: dict[str, Any], channel: str | None, unit: str
) -> None:
    source = _rests(tmp_path / "run.csv", **clock)
    fields = _guess(source, "joint_torque_static")
    assert (fields.time, fields.time_unit) == (channel, unit)
    assert fields.columns["q"].channels == ("q0", "q1")
    [episode] = import_recordings([source], fields, ImportProcessing()).episodes
    np.testing.assert_allclose(episode["tau"], _Q[:20, 2:4], atol=1e-8)
    assert set(episode) == {"q", "tau", "order" if unit == "1" else "time"}


def test_rests_without_torques_are_refused(tmp_path: Path) -> None:
    source = _table(tmp_path / "run.csv", q0=_Q[:20, 0], q1=_Q[:20, 1])
    message = refusal(_guess, source, "joint_torque_static")
    assert "no channel is called as joint torques are" in message
    assert "called as time is" in refusal(_guess, source)  # a motion needs times
