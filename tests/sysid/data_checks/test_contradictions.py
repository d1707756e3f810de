"""Rows that contradict readings at rest, and readings that are what they say."""

import itertools

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation

from drake_disasm.logs import Log, read_log, write_static_wrench
from drake_disasm.logs.importing.field_map import read_map
from sysid.data_checks import check_data, contradicting_rows, without_flagged_rows
from sysid.models.base import LogModel
from sysid.models.from_logs import ModelChoice, model_of
from tests.sysid.models.arm import JOINTS, write_two_link_arm
from tests.sysid.models.rests import write_rests
from tests.sysid.real_data import real_folder, write_static

_POSES, _EACH, _PERIOD = 12, 40, 0.1
_ROWS = _POSES * _EACH


def write(folder, extra, weight=10.0, moving=0, timed=True) -> Log:
    """Writes readings at 10 Hz of a load that rests by turns.

    Args:
        folder: of the log.
        extra: (rows, 3) forces that are no load's [N].
        weight: of the load [N].
        moving: rows of motion from a pose to the next.
        timed: whether the log has times.
    """
    poses = Rotation.random(_POSES, random_state=2)
    quaternions = np.repeat(poses.as_quat(scalar_first=True), _EACH, axis=0)
    R_WS = Rotation.from_quat(quaternions, scalar_first=True)
    if moving:
        turn = np.where(np.arange(_ROWS) % _EACH < moving, np.arange(_ROWS) % _EACH, 0)
        R_WS = R_WS * Rotation.from_rotvec(np.outer(0.05 * turn, [1.0, 0.0, 0.0]))
    bias = np.array([1.0, -2.0, 0.5])
    force = R_WS.inv().apply([0.0, 0.0, -weight]) + bias + extra
    force += 0.03 * np.random.default_rng(3).standard_normal(force.shape)
    wrench = np.hstack([force, 0.01 * force])
    time = _PERIOD * np.arange(_ROWS) if timed else None
    q = R_WS.as_quat(scalar_first=True)
    write_static_wrench(folder / "log", q, wrench, "S", "weigh", {}, time)
    return read_log(folder / "log")


def model(log: Log) -> LogModel:
    return model_of([log], ModelChoice(fixed=True))


def contact(rows=_ROWS):
    """Forces that come and go within a second or two, correlated by 0.95."""
    noise = np.random.default_rng(4).standard_normal((rows, 3))
    pushes = lfilter([1.0], [1.0, -0.95], noise, axis=0)
    return pushes / pushes.std()


ones = np.ones((_ROWS, 3))
clock = np.arange(_ROWS)[:, None] / _ROWS


@pytest.mark.parametrize(
    "extra",
    [
        0.0 * ones,
        0.2 * np.random.default_rng(5).standard_normal((_ROWS, 3)),
        3.0 * clock * ones,
        3.0 * np.exp(-5.0 * clock) * ones,
        2.0 * (clock > 0.4) * ones,
        0.2 * contact(),
    ],
    ids=["nothing", "noise", "drift", "warm-up", "step", "slow noise"],
)
def test_sensors_err_without_a_contradiction(extra, tmp_path):
    assert contradicting_rows(model(write(tmp_path, extra))) == []


@pytest.mark.parametrize("weight", [0.0, 5.0])
def test_contact_is_no_load(weight, tmp_path):
    log = write(tmp_path, 3.0 * contact(), weight)
    [found] = contradicting_rows(model(log))
    assert found.kind == "contact" and not found.rows
    assert "N (rms) at one orientation" in found.what and "contact" in found.remedy
    assert found in check_data([log], model(log))


def test_moving_rows_contradict_until_they_are_left_out(tmp_path):
    log = write(tmp_path, 0.0 * ones, moving=8)
    whole = model(log)
    [found] = contradicting_rows(whole)
    assert found.kind == "moving"
    [rows] = found.rows.values()
    assert {row % _EACH for row in rows} <= set(range(9))
    findings = check_data([log], whole)
    assert found in findings
    assert contradicting_rows(without_flagged_rows([log], whole, findings)) == []


def test_joints_that_move_between_poses_contradict_rests(tmp_path):
    """From pose to pose in a second, at 10 Hz, and three seconds in each."""
    urdf = write_two_link_arm(tmp_path / "two.urdf")
    poses = np.random.default_rng(0).uniform(-1.0, 1.0, (12, 2))
    way = np.clip(np.arange(40) / 10.0, 0.0, 1.0)[:, None]
    q = np.vstack([a + way * (b - a) for a, b in itertools.pairwise(poses)])
    logs = [
        write_rests(tmp_path / name, urdf, JOINTS, q, np.cos(q), time)
        for name, time in (("timed", 0.1 * np.arange(len(q))), ("ordered", None))
    ]
    [found] = contradicting_rows(model(logs[0]))
    assert found.kind == "moving"
    [rows] = found.rows.values()
    assert set(range(1, 10)) <= {row % 40 for row in rows} <= set(range(11))
    resting = without_flagged_rows([logs[0]], model(logs[0]), [found])
    assert contradicting_rows(resting) == []
    assert contradicting_rows(model(logs[1])) == []


def test_an_order_says_nothing_of_motion(tmp_path):
    log = write(tmp_path, 3.0 * contact(), moving=8, timed=False)
    assert contradicting_rows(model(log)) == []


def test_another_kind_of_log_has_none(arm_log):
    assert contradicting_rows(model(arm_log)) == []


@pytest.mark.parametrize("rows", [7, 100])
def test_a_real_sensor_at_rest_has_none(rows, tmp_path):
    assert contradicting_rows(model(read_log(write_static(rows, tmp_path / "l")))) == []


def test_a_real_contact_is_named_with_and_without_its_moving_rows(tmp_path):
    path = real_folder("cases") / "contact_as_static" / "run.csv"
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    frame = read_map(path.with_name("map.yaml")).frames["wrench"]
    time, q, wrench = table[:, 0], table[:, 1:5], table[:, 5:]
    write_static_wrench(tmp_path / "log", q, wrench, frame, "press", {}, time)
    log = read_log(tmp_path / "log")
    whole = model(log)
    assert [f.kind for f in contradicting_rows(whole)] == ["moving", "contact"]
    resting = without_flagged_rows([log], whole, check_data([log], whole))
    assert [f.kind for f in contradicting_rows(resting)] == ["contact"]
