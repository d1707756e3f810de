"""Ways to write readings at rest wrongly, of readings that are right but for that."""

import dataclasses

import numpy as np
import pytest
from damaged_logs import both, damaged, scaled, swapped
from scipy.spatial.transform import Rotation

from drake_disasm.logs import Log, read_log, write_static_wrench
from drake_disasm.scenario import load_scenario
from sysid.models.bookkeeping import Bookkeeping
from sysid.models.from_logs import ModelChoice, model_of
from sysid.models.static_wrench import StaticWrenchModel
from tests.sysid.real_data import real_folder, write_static

_TRUTH = np.array([1.2, 0.01, -0.02, 0.07, 1.0, -2.0, 3.0, 0.1, -0.2, 0.05])
_NOISE = np.array([0.05] * 3 + [0.002] * 3)


def write(
    folder,
    turned=None,
    frame="S",
    mounted=None,
    rows=40,
    mass=_TRUTH[0],
    read_as=lambda wxyz: wxyz,
) -> Log:
    """Writes readings of a load.

    Args:
        folder: of the log.
        turned: the log's W in the true one.
        frame: of the wrench.
        mounted: the sensor's true frame in S.
        rows: how many.
        mass: of the load [kg]; zero takes its weight away.
        read_as: makes quaternions of those that are right.
    """
    R_WS = Rotation.random(rows, random_state=3)
    g_S = R_WS.inv().apply([0.0, 0.0, -9.81])
    load = np.hstack([mass * g_S, np.cross(mass / _TRUTH[0] * _TRUTH[1:4], g_S)])
    if mounted is not None:
        load = np.hstack([mounted.inv().apply(part) for part in np.hsplit(load, 2)])
    wrench = load + _TRUTH[4:]
    wrench += _NOISE * np.random.default_rng(1).standard_normal((rows, 6))
    written = R_WS if turned is None else turned.inv() * R_WS
    if frame == "W":
        wrench = np.hstack([written.apply(part) for part in np.hsplit(wrench, 2)])
    quaternions = read_as(written.as_quat(scalar_first=True))
    write_static_wrench(folder / "log", quaternions, wrench, frame, "weigh", {})
    return read_log(folder / "log")


def ways(log: Log, choice=None) -> list[Bookkeeping[StaticWrenchModel]]:
    found = model_of([log], choice or ModelChoice())
    assert isinstance(found, StaticWrenchModel)
    return found.bookkeeping()


def rms(model: StaticWrenchModel) -> float:
    """Returns what the load's parameters leave, in units of the noise."""
    theta = np.zeros(len(model.parameters))
    columns = [
        model.predictions(step) - model.predictions(theta)
        for step in np.eye(len(theta))
    ]
    A = np.stack(columns, axis=-1) / _NOISE[:, None]
    values = (model.measurements.values - model.predictions(theta)) / _NOISE
    A, values = A.reshape(-1, len(theta)), values.reshape(-1)
    left = values - A @ np.linalg.lstsq(A, values, rcond=None)[0]
    return float(np.sqrt(np.mean(left**2)))


@pytest.mark.parametrize("frame", ["S", "W"])
def test_right_readings_have_no_other_way(frame, tmp_path):
    assert ways(write(tmp_path, frame=frame)) == []
    assert ways(write(tmp_path / "few", frame=frame, rows=7)) == []


@pytest.mark.parametrize("frame", ["S", "W"])
@pytest.mark.parametrize("angle", [20.0, 81.0, 150.0])
def test_a_turned_world_is_turned_back(frame, angle, tmp_path):
    axis = np.array([0.6, 0.8, 0.0])
    turned = Rotation.from_rotvec(np.radians(angle) * axis)
    [way] = ways(write(tmp_path, turned, frame, rows=17))
    assert way.name == "GravityDirection" and way.estimated == 2
    assert f"{angle:.0f} degrees" in way.what
    down = way.model._g_W / np.linalg.norm(way.model._g_W)
    np.testing.assert_allclose(down, turned.inv().apply([0.0, 0.0, -1.0]), atol=0.01)
    assert 0.7 < rms(way.model) < 1.3


def test_a_tilt_is_an_effect(tmp_path):
    turned = Rotation.from_rotvec([0.1, 0.0, 0.0])
    assert ways(write(tmp_path, turned)) == []


def test_a_sensor_that_is_mounted_far_otherwise(tmp_path):
    mounted = Rotation.from_rotvec([0.0, 0.7, 0.9])
    [way] = ways(write(tmp_path, mounted=mounted))
    assert way.name == "SensorFrame" and way.estimated == 3
    assert 0.7 < rms(way.model) < 1.3


@pytest.mark.parametrize("frame", ["S", "W"])
def test_the_other_frame_is_said(frame, tmp_path):
    log = write(tmp_path, frame=frame)
    said = {"wrench": "S" if frame == "W" else "W"}
    header = dataclasses.replace(log.header, frames=said)
    [way] = ways(dataclasses.replace(log, header=header))
    assert way.name == "WrenchFrame" and f"expressed in {frame}" in way.what
    assert 0.7 < rms(way.model) < 1.3


@pytest.mark.parametrize("frame", ["S", "W"])
@pytest.mark.parametrize(
    ("name", "read_as"),
    [
        ("OrientationInverse", lambda q: q * [1.0, -1.0, -1.0, -1.0]),
        ("QuaternionOrder", lambda q: np.roll(q, -1, axis=1)),
        ("QuaternionOrder", lambda q: np.roll(q, 1, axis=1)),
    ],
)
def test_orientations_that_are_read_wrongly(name, read_as, frame, tmp_path):
    [way] = ways(write(tmp_path, frame=frame, read_as=read_as))
    assert way.name == name
    assert 0.7 < rms(way.model) < 1.3


@pytest.mark.parametrize("frame", ["S", "W"])
@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (scaled(-1.0, "wrench.fx"), "fx = -fx"),
        (swapped("wrench.fx", "wrench.fz"), "fx = fz, fz = fx"),
        (swapped("wrench.tx", "wrench.ty", -1.0), "tx = -ty, ty = -tx"),
        (
            both(scaled(-1.0, "wrench.fy"), scaled(-1.0, "wrench.ty")),
            "fy = -fy, ty = -ty",
        ),
    ],
)
def test_axes_are_put_right(damage, words, frame, tmp_path):
    log = write(tmp_path, frame=frame)
    [way] = ways(damaged(log, damage))
    assert way.name == "WrenchAxes" and words in way.what
    expected = model_of([log], ModelChoice()).measurements.values
    np.testing.assert_allclose(way.model.measurements.values, expected, atol=1e-9)


def test_a_weight_that_is_taken_away_has_no_parameters(tmp_path):
    log = write(tmp_path, mass=0.0, rows=100)
    assert ways(log) == []  # nothing may hang on the sensor
    [way] = ways(log, ModelChoice(scenario=load_scenario("removal")))
    assert way.name == "WeightRemoved" and "raw reading" in way.remedy
    names = [p.name for p in way.model.parameters]
    assert len(names) == 6 and all("SensorBias" in name for name in names)
    assert 0.7 < rms(way.model) < 1.3


@pytest.mark.parametrize("rows", [1, 2, 4, 6])
def test_few_readings_tell_nothing(rows, tmp_path):
    turned = Rotation.from_rotvec([0.0, 0.1, 0.0])
    assert ways(write(tmp_path, turned, rows=rows)) == []


@pytest.mark.parametrize("seed", range(5))
def test_forces_that_drift_at_one_orientation_tell_no_frame(seed, tmp_path):
    random = np.random.default_rng(seed)
    turns, wrench = (np.cumsum(random.normal(size=(30, k)), axis=0) for k in (3, 6))
    quaternions = Rotation.from_rotvec(1e-3 * turns).as_quat(scalar_first=True)
    write_static_wrench(tmp_path / "log", quaternions, wrench, "S", "weigh", {})
    assert ways(read_log(tmp_path / "log")) == []


def test_one_orientation_tells_no_weight_from_a_bias(tmp_path):
    log = write(tmp_path, mass=0.0, rows=100, read_as=lambda q: 0.0 * q + q[:1])
    assert ways(log) == []


@pytest.mark.parametrize("rows", [7, 100])
def test_a_real_sensor_is_written_right(rows, tmp_path):
    assert ways(read_log(write_static(rows, tmp_path / "log"))) == []


def test_gravity_of_real_poses_is_turned_by_81_degrees(tmp_path):
    path = real_folder("cases") / "static_order" / "poses.csv"
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    write_static_wrench(tmp_path / "log", table[:, 1:5], table[:, 5:], "S", "weigh", {})
    [way] = ways(read_log(tmp_path / "log"))
    assert way.name == "GravityDirection" and "81 degrees" in way.what
    down = way.model._g_W / np.linalg.norm(way.model._g_W)
    np.testing.assert_allclose(down, [0.987, 0.019, -0.162], atol=2e-3)
