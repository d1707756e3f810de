"""From recordings to logs: maps, guesses, time lines, and what stands in the log."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from drake_disasm.cell.parsing import movable_joints
from drake_disasm.common.resources import ONE_JOINT_MODELS
from drake_disasm.free_motion.cell_urdf import cell_urdf
from drake_disasm.logs import Log, read_log
from drake_disasm.logs.importing import (
    FieldMap,
    ImportProcessing,
    Known,
    guessed_map,
    import_recordings,
    read_map,
    read_source,
    write_log,
)
from drake_disasm.logs.importing.description import joint_words
from drake_disasm.logs.importing.field_map import Column, parse_map
from drake_disasm.logs.importing.importer import lone_joint
from drake_disasm.logs.importing.shift import link_features
from drake_disasm.logs.importing.source import Source
from drake_disasm.logs.importing.usage import without_torques
from drake_disasm.scenario import load_scenario
from tests.drake_disasm.logs.importing.bag import motion, record_arm
from tests.refusals import refusal


def _table(
    path: Path, rows: int = 2000, period: float = 0.005, change: Any = None, **more: Any
) -> Path:
    """Writes a recording of the two joints as NPZ: q in degrees, time in ms.

    Args:
        path, rows, period: of it.
        change: is called with its arrays by name before they are written.
        more: arrays.
    """
    time = period * np.arange(rows)
    q, v, vd = (np.stack(x) for x in zip(*map(motion, time), strict=True))
    values = {"t": 1e3 * time, "angle": np.degrees(q), "current": vd + 0.1 * v} | more
    if change:
        change(values)
    np.savez(path, **values)
    return path


_TORQUE = {"from": ["current.0", "current.1"], "scale": "kt", "sign": [1, -1]}
_ANGLE = {"from": ["angle.0", "angle.1"], "unit": "deg"}
_FIELDS = {
    "kind": "joint_motion",
    "joints": ["a", "b"],
    "time": {"from": "t", "unit": "ms"},
    "columns": {"q": _ANGLE, "tau": _TORQUE},
}


_RAW = ImportProcessing(cutoff=5.0)


def _fields(**columns: Any) -> FieldMap:
    return parse_map(_FIELDS | {"columns": columns})


def _csv(path: Path, names: Sequence[str], *columns: np.ndarray) -> Source:
    """Writes a table as CSV and reads it."""
    table = np.column_stack(columns)
    np.savetxt(path, table, "%.17g", ",", header=",".join(names), comments="")
    return read_source(path)


def _guessed_log(source: Source, kind: str, folder: Path) -> Log:
    """Returns the log that is made of a source by a guessed map."""
    fields = guessed_map(source, kind)
    found = import_recordings([source], fields, ImportProcessing())
    write_log(found, [source], fields, folder, {})
    return read_log(folder)


def _imported(path: Path, fields: FieldMap, **options: Any) -> Any:
    return import_recordings([read_source(path)], fields, ImportProcessing(**options))


def test_units_scales_and_signs_make_SI(tmp_path: Path) -> None:
    fields = _fields(q=_ANGLE, tau=_TORQUE | {"scale": 2.0})
    found = _imported(_table(tmp_path / "run.npz"), fields, cutoff=20.0)
    [episode] = found.episodes
    q, v, vd = motion((found.done.reach * 0.005 + episode["time"])[:, None])
    np.testing.assert_allclose(episode["q"], q, atol=2e-3)
    np.testing.assert_allclose(episode["v"], v, atol=2e-2)
    np.testing.assert_allclose(episode["vd"], vd, atol=0.1)
    torque = 2.0 * (vd + 0.1 * v) * np.array([1.0, -1.0])
    np.testing.assert_allclose(episode["tau"], torque, atol=0.1)


def test_a_scale_may_be_a_constant_of_the_recording(tmp_path: Path) -> None:
    fields = parse_map(_FIELDS)
    plain = _imported(_table(tmp_path / "a.npz", kt=1.0), fields).episodes[0]["tau"]
    scaled = _imported(_table(tmp_path / "b.npz", kt=3.0), fields).episodes[0]["tau"]
    np.testing.assert_allclose(scaled, 3.0 * plain)
    without = _table(tmp_path / "c.npz")
    assert "scale 'kt' is no constant" in refusal(_imported, without, fields)
    alone = _fields(tau=_TORQUE | {"scale": 1.0})
    assert "a joint_motion log needs q" in refusal(_imported, without, alone)


def test_the_same_filter_acts_on_both_sides(tmp_path: Path) -> None:
    """An equation that holds of the recording holds of the log, noise and all."""
    random, time = np.random.default_rng(5), 0.002 * np.arange(8000)
    q = sum(np.sin(2.0 * np.pi * f * time) for f in (0.5, 1.3, 2.2))
    q = q + 1e-3 * random.standard_normal(len(time))
    np.savez(tmp_path / "run.npz", time=time, q=q, tau=5.0 * q)
    fields = guessed_map(read_source(tmp_path / "run.npz"), "joint_motion")
    [episode] = _imported(tmp_path / "run.npz", fields).episodes
    np.testing.assert_allclose(episode["tau"], 5.0 * episode["q"], atol=1e-12)


def test_a_map_survives_its_file(tmp_path: Path) -> None:
    fields = _fields(q={"from": ["x", "y"], "offset": 0.1})
    (tmp_path / "map.yaml").write_text(fields.to_yaml())
    assert read_map(tmp_path / "map.yaml") == fields


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"kind": "movie"}, "kind 'movie' does not exist"),
        ({"columns": {"force": {"from": "x"}}}, "has no column 'force'"),
        ({"columns": {"q": {"from": "x"}}}, "q has 1 channels, not 2"),
        ({"columns": {"q": {}}}, "q has no 'from'"),
        ({"columns": {"q": {"from": []}}}, "q.from is empty"),
        ({"columns": {"q": {"from": ["x", "y"], "unit": "degree"}}}, "degree"),
        ({"columns": {"q": {"from": ["x", "y"], "sign": 2}}}, "sign is 1 or -1"),
        ({"columns": {"q": {"from": ["x", "y"], "scale": [1, 2, 3]}}}, "3 scales"),
        ({"clock": 1}, "unknown key 'clock'"),
        ({"time": {"from": "t", "unit": "min"}}, "unit 'min' is not known"),
    ],
)
def test_a_wrong_map_is_refused(tmp_path, changes: dict[str, Any], said: str) -> None:
    np.savez(tmp_path / "run.npz", **dict.fromkeys("txy", np.arange(50.0)))

    def read() -> None:
        _imported(tmp_path / "run.npz", parse_map(_FIELDS | changes))

    assert said in refusal(read)


def test_a_bag_s_clocks_are_brought_together(tmp_path: Path) -> None:
    record_arm(tmp_path / "bag", shift=0.012)
    source = read_source(tmp_path / "bag")
    fields = guessed_map(source, "joint_motion", Known(("shoulder", "elbow")))
    found = import_recordings([source], fields, ImportProcessing())
    shift = found.recordings[0].shifts["/ft"]
    assert shift.seconds == pytest.approx(-0.012, abs=1e-3)
    assert shift.low < shift.seconds < shift.high and shift.is_seen
    [episode] = found.episodes
    v = motion(episode["time"][:, None])[1]
    assert episode["v"].shape == v.shape  # both joints in the order that was asked for
    amplitude = np.ptp(episode["q"], axis=0)
    assert amplitude == pytest.approx([1.6, 1.0], rel=1e-2)
    # The wrench is that of its own time now: force x is twice the acceleration.
    error = episode["extra.fx"] - 2.0 * episode["vd"][:, 0]
    assert np.std(error) < 0.01 * np.std(episode["extra.fx"])
    clock = found.done.clocks[0] if found.done else None
    assert clock and clock.lost == pytest.approx(80, abs=30)


def test_streams_with_nothing_in_common_show_no_shift(tmp_path: Path) -> None:
    record_arm(tmp_path / "bag", shift=0.0)
    source = read_source(tmp_path / "bag")
    random = np.random.default_rng(0)
    for stream in source.streams:
        if stream.name == "/ft":
            for values in stream.channels.values():
                values[:] = random.standard_normal(len(values))
    fields = guessed_map(source, "joint_motion")
    found = import_recordings([source], fields, ImportProcessing())
    assert not found.recordings[0].shifts["/ft"].is_seen


def test_gaps_part_episodes_and_rows_that_can_t_be_go(tmp_path: Path) -> None:
    """Without numbers, absurd, twice, or in a burst, whose slopes would be noise."""
    time = 0.005 * np.arange(4000)
    time[2000:] += 1.0
    q = np.sin(2.0 * np.pi * 0.7 * time)
    q[100], q[700] = np.nan, 1e300
    time[200], time[500] = time[199], time[499] + 1e-6
    np.savez(tmp_path / "run.npz", time=time, q=q)
    source = read_source(tmp_path / "run.npz")
    found = _imported(tmp_path / "run.npz", guessed_map(source, "joint_motion"))
    assert len(found.episodes) == 2
    assert sum(found.dropped.values()) == 4
    assert np.diff(found.recordings[0].time).min() > 0.004


def test_rows_of_another_topic_in_a_table_are_no_lost_rows(tmp_path: Path) -> None:
    """PlotJuggler leaves the cells of all other topics empty in each row."""
    time = 0.005 * np.arange(4000)
    own = np.arange(4000) % 2 == 0
    q, tau = (np.where(own, wave(time), np.nan) for wave in (np.sin, np.cos))
    temperature = np.where(own, np.nan, 20.0 + time)
    columns = {"time": time, "q": q, "tau": tau, "temperature": temperature}
    source = _csv(tmp_path / "run.csv", list(columns), *columns.values())
    found = import_recordings([source], guessed_map(source, "joint_motion"), _RAW)
    assert found.dropped == {"of other channels": 2000}
    assert found.recordings[0].time[1] == pytest.approx(0.01)
    columns["temperature"] = 20.0 + time  # in all rows: these are lost
    source = _csv(tmp_path / "run.csv", list(columns), *columns.values())
    fields = guessed_map(source, "joint_motion")
    message = refusal(import_recordings, [source], fields, _RAW)
    assert "2000 without numbers" in message


def test_a_log_says_what_was_done(tmp_path: Path) -> None:
    path = _table(tmp_path / "run.npz", kt=1.0)
    source, fields = read_source(path), parse_map(_FIELDS)
    found = import_recordings([source], fields, ImportProcessing())
    write_log(found, [source], fields, tmp_path / "log", {"command": "x"})
    log = read_log(tmp_path / "log")
    origin = log.header.provenance["import"]
    assert origin["sources"] == {str(path): source.sha256}
    assert parse_map(origin["map"]) == fields
    done = origin["processing"]
    assert done["cutoff_Hz"] == found.done.cutoff if found.done else False
    assert log.header.joints == ("a", "b") and log.episodes[0].rows == found.rows


@pytest.mark.parametrize(
    ("q", "tau", "urdf", "how"),
    [
        ({}, {}, "", "turns"),
        ({"unit": "mm"}, {}, "", "slides"),
        ({}, {"unit": "N"}, "", "slides"),
        ({"unit": "mm"}, {}, "arm.urdf", ""),
    ],
)
def test_a_single_joint_needs_no_urdf(
    tmp_path: Path, q: dict[str, str], tau: dict[str, str], urdf: str, how: str
) -> None:
    source = read_source(_table(tmp_path / "run.npz"))
    columns = {"q": {"from": "angle.0", **q}, "tau": {"from": "current.0", **tau}}
    one = {"joints": ["a"], "urdf": urdf, "columns": columns}
    fields = parse_map(_FIELDS | one)
    found = import_recordings([source], fields, ImportProcessing())
    write_log(found, [source], fields, tmp_path / "log", {})
    expected = ONE_JOINT_MODELS[how] if how else str(Path(urdf).resolve())
    assert read_log(tmp_path / "log").header.urdf == expected
    assert lone_joint(fields) == how and how in joint_words(fields)
    assert lone_joint(parse_map(_FIELDS)) == ""


def test_a_filter_or_gaps_that_leave_no_stretch_are_refused(tmp_path: Path) -> None:
    path, fields = _table(tmp_path / "run.npz", rows=200, kt=1.0), parse_map(_FIELDS)
    message = refusal(_imported, path, fields, cutoff=0.5)
    assert "no stretch without gaps is longer" in message
    message = refusal(_imported, path, fields, cutoff=150.0)
    assert "is not below half the sampling rate" in message

    def part(values: dict[str, np.ndarray]) -> None:
        values["t"] += 1e4 * (np.arange(2000) // 3)

    path = _table(tmp_path / "run.npz", change=part, kt=1.0)
    message = refusal(_imported, path, parse_map(_FIELDS))
    assert "no stretch of 4 rows is without gaps" in message


def test_a_sensor_in_contact_is_guessed_with_the_rows_in_free_space(
    tmp_path: Path,
) -> None:
    names = ["time", "qw", "qx", "qy", "qz", "fx", "fy", "fz", "tx", "ty", "tz", "free"]
    quaternion = np.tile([1.0, 0.0, 0.0, 0.0], (9, 1))
    free = (np.arange(9) < 4).astype(float)
    columns = (0.1 * np.arange(9.0), quaternion, np.zeros((9, 6)), free)
    source = _csv(tmp_path / "run.csv", names, *columns)
    [episode] = _guessed_log(source, "contact", tmp_path / "log").episodes
    np.testing.assert_array_equal(episode["free"], free)


def test_names_and_units_of_many_kinds_are_guessed(tmp_path: Path) -> None:
    time = 0.01 * np.arange(100)
    for names in (
        ("time", "q_0", "q_1"),
        ("t", "position.0", "position.1"),
        ("timestamp", "pos[0]", "pos[1]"),
        ("Time", "Theta1", "Theta2"),
        ("%time", "field.position0", "field.position1"),  # rostopic echo -p
        ("__time", "/joint_states/position[0]", "/joint_states/position[1]"),
    ):
        source = _csv(tmp_path / "run.csv", names, time, np.sin(time), np.cos(time))
        fields = guessed_map(source, "joint_motion")
        assert fields.time == names[0].lstrip("%")
        assert fields.columns == {"q": Column(names[1:])}
    for unit, step in (("s", 0.01), ("ms", 10.0), ("us", 1e4), ("ns", 1e7)):
        path = tmp_path / "run.npz"
        np.savez(path, t=step * np.arange(50), q=np.arange(50.0))
        assert guessed_map(read_source(path), "joint_motion").time_unit == unit


def test_commanded_and_measured_positions_become_a_response(tmp_path: Path) -> None:
    path = tmp_path / "servo.csv"
    lines = [f"{0.005 * i},{0.01 * i},{0.009 * i},7.4,1" for i in range(40)]
    head = "time,goal_position,position,input_volts,torque_enable"
    path.write_text("\n".join(["# a servo", head, *lines]))
    fields = guessed_map(
        read_source(path), "joint_response", Known(["servo"], urdf="servo.urdf")
    )
    fields = parse_map(yaml.safe_load(fields.to_yaml()) | {"drive": {"limit": 1.0}})
    imported = _imported(path, fields)
    write_log(imported, [read_source(path)], fields, tmp_path / "log", {})
    log = read_log(tmp_path / "log")
    assert log.header.drive == {"limit": 1.0}
    assert log.header.joints == ("servo",)
    [episode] = log.episodes
    np.testing.assert_allclose(episode["q_commanded"][:, 0], 0.01 * np.arange(40))
    np.testing.assert_allclose(episode["q"][:, 0], 0.009 * np.arange(40))
    np.testing.assert_array_equal(episode["supply"], 7.4)
    np.testing.assert_array_equal(episode["enabled"], 1.0)


def test_recordings_at_two_rates_get_one(tmp_path: Path) -> None:
    """The filter is of one period: at another its derivatives would be off."""
    paths = _table(tmp_path / "a.npz", kt=1.0), tmp_path / "b.npz"
    _table(paths[1], rows=2500, period=0.004, kt=1.0)
    sources = [read_source(path) for path in paths]
    found = import_recordings(
        sources, parse_map(_FIELDS), ImportProcessing(cutoff=20.0)
    )
    for episode in found.episodes:
        begin = found.done.reach * found.period / found.done.decimation
        _, v, _ = motion((begin + episode["time"])[:, None])
        assert np.abs(episode["v"] - v).max() < 0.02


def test_a_bench_in_the_urdf_is_not_what_the_sensor_carries(tmp_path: Path) -> None:
    """The cell's URDF ends with links that are fixed to the world."""
    path = tmp_path / "cell.urdf"
    path.write_text(cell_urdf(load_scenario("removal")))
    arm = "package://disasm_models/iiwa14/iiwa14.urdf"
    joints = movable_joints(arm)
    q, v, vd = np.random.default_rng(0).uniform(-1.0, 1.0, (3, 5, len(joints)))
    found = [link_features(urdf, joints)(q, v, vd) for urdf in (str(path), arm)]
    np.testing.assert_allclose(*found, atol=1e-9)
    assert np.ptp(found[0], axis=0)[1:].min() > 0.1  # it moves


def test_a_log_without_torques_says_what_was_not_used(tmp_path: Path) -> None:
    t = 0.01 * np.arange(500)
    wave = np.sin(t)
    source = _csv(tmp_path / "run.csv", ("time", "q_0", "t_0"), t, wave, 3.0 * wave)
    fields = guessed_map(source, "joint_motion")
    assert "not used: t_0" in without_torques(source, fields)
    column = {"tau": Column(("t_0",))}
    whole = dataclasses.replace(fields, columns={**fields.columns, **column})
    assert without_torques(source, whole) == ""
