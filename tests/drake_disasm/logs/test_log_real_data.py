"""Real measurements, where they are there, become logs and come back."""

import numpy as np
import pytest

from drake_disasm.logs import (
    LogHeader,
    LogWriter,
    flat_columns,
    read_log,
    sensor_wrench,
    write_static_wrench,
)
from tests.sysid.real_data import real_folder


@pytest.mark.parametrize(("rows", "file_format"), [(7, "parquet"), (100, "csv")])
def test_static_readings_of_a_real_sensor(rows, file_format, tmp_path):
    folder = real_folder("ft_static")
    pose = np.loadtxt(folder / f"pose_{rows}.txt", delimiter=",")
    wrench = np.loadtxt(folder / f"wrench_{rows}.txt", delimiter=",")
    wxyz = pose[:, [6, 3, 4, 5]]
    provenance = {"source": "leledeyuan00/Gravity-Compensation-F-T-sensor"}
    write_static_wrench(
        tmp_path / "log", wxyz, wrench, "W", "weigh", provenance, None, file_format
    )

    log = read_log(tmp_path / "log")
    (episode,) = log.episodes
    assert episode["wrench"].tobytes() == wrench.tobytes()
    assert episode["R_WS"].tobytes() == wxyz.tobytes()
    force = sensor_wrench(log.header, episode)[:, :3]
    np.testing.assert_allclose(
        np.linalg.norm(force, axis=1), np.linalg.norm(wrench[:, :3], axis=1)
    )


def test_the_sensors_frame_shows_its_constant_bias(tmp_path):
    """The published fit of the 7 poses holds in the frame that the loader offers.

    Weight -10.80391 N along the world's z, bias (-2.13583, -2.76399, -13.07675) N
    in the sensor's frame: `f_S = R_WS' [0, 0, weight] + bias`.
    """
    folder = real_folder("ft_static")
    pose = np.loadtxt(folder / "pose_7.txt", delimiter=",")
    wrench = np.loadtxt(folder / "wrench_7.txt", delimiter=",")
    write_static_wrench(
        tmp_path / "log", pose[:, [6, 3, 4, 5]], wrench, "W", "weigh", {}
    )
    log = read_log(tmp_path / "log")
    force_S = sensor_wrench(log.header, log.episodes[0])[:, :3]
    x, y, z, w = pose[:, 3:].T
    up_S = np.column_stack(
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x**2 + y**2)]
    )
    model = -10.80391 * up_S + [-2.13583, -2.76399, -13.07675]
    assert np.sqrt(np.mean((force_S - model) ** 2)) < 0.2


def test_two_recordings_of_a_real_arm(tmp_path):
    folder = real_folder("kuka_lwr4")
    names = {
        "time": "times",
        "q": "positions",
        "v": "velocities",
        "vd": "accelerations",
        "tau": "torques",
    }
    joints = tuple(f"lwr_{i}_joint" for i in range(7))
    header = LogHeader("joint_motion", "excite", {}, period=0.005, joints=joints)
    recordings = [np.load(folder / f"recording_{i}.npz") for i in (1, 2)]
    with LogWriter(tmp_path / "log", header, "csv") as writer:
        for recording in recordings:
            vectors = {name: recording[key] for name, key in names.items()}
            writer.write_episode(flat_columns("joint_motion", vectors))

    log = read_log(tmp_path / "log")
    for episode, recording in zip(log.episodes, recordings, strict=True):
        for name, key in names.items():
            assert episode[name].tobytes() == recording[key].tobytes()
