"""What is written is what is read, bit for bit."""

import subprocess

import numpy as np
import pytest

from drake_disasm.logs import (
    KINDS,
    LogHeader,
    LogWriter,
    flat_columns,
    read_log,
    read_logs,
    rotation_matrices,
    sensor_wrench,
    write_static_wrench,
)

FORMATS = ("parquet", "csv")


@pytest.mark.parametrize("file_format", FORMATS)
@pytest.mark.parametrize("kind", KINDS)
def test_values_come_back_bit_for_bit(kind, file_format, written, sample, headers):
    log = read_log(written(kind, file_format, episodes=3))
    assert log.header == headers[kind]
    assert [e.name for e in log.episodes] == [f"episode_000{i}" for i in range(3)]
    for seed, episode in enumerate(log.episodes):
        expected = sample(kind, seed)
        assert set(episode.columns) == set(expected)
        for name, values in expected.items():
            read = episode[name]
            assert read.dtype == values.dtype, name
            assert read.tobytes() == values.tobytes(), name


def test_columns_come_in_declared_order(tmp_path, headers, sample):
    columns = sample("transitions")
    backwards = dict(reversed(columns.items()))
    LogWriter(tmp_path / "log", headers["transitions"]).write_episode(backwards)
    episode = read_log(tmp_path / "log").episodes[0]
    assert next(iter(episode.columns)) == "time"
    assert list(episode.columns)[-2:] == ["terminated", "truncated"]
    names = [f"wrench.{c}" for c in ("fx", "fy", "fz", "tx", "ty", "tz")]
    expected = np.column_stack([columns[name] for name in names])
    np.testing.assert_array_equal(episode["wrench"], expected)
    assert episode["time"].shape == (episode.rows,)
    assert episode["q"].shape == (episode.rows, 7)
    assert "tau" not in episode and "ft_sensor" in episode
    assert set(episode.components("reward")) == {"reward.distance", "reward.force"}


def test_formats_mix_in_a_log(tmp_path, headers, sample):
    folder, header = tmp_path / "log", headers["static_wrench"]
    LogWriter(folder, header, "csv").write_episode(sample("static_wrench", 0))
    again = LogWriter(folder, header, "parquet", resume=True)
    assert again.write_episode(sample("static_wrench", 1)).name.endswith("1.parquet")
    assert [e.path.suffix for e in read_log(folder).episodes] == [".csv", ".parquet"]


def test_data_hash_is_that_of_the_shell(written):
    folder = written("static_wrench", "csv", episodes=2)
    command = "sha256sum episode_* | sha256sum"
    shell = subprocess.run(
        command, shell=True, cwd=folder, capture_output=True, text=True, check=True
    )
    log = read_log(folder)
    assert shell.stdout.split()[0] == log.data_hash
    episode = log.episodes[1].path
    episode.write_bytes(episode.read_bytes() + b"\n")
    assert read_log(folder).data_hash != log.data_hash


def test_numbers_order_the_episodes_and_gaps_are_allowed(written):
    folder = written("joint_motion", "csv", episodes=2)
    (folder / "episode_0000.csv").rename(folder / "episode_10000.csv")
    (folder / "episode_0001.csv").rename(folder / "episode_9999.csv")
    names = [episode.name for episode in read_log(folder).episodes]
    assert names == ["episode_9999", "episode_10000"]


def test_an_interrupted_episode_without_joints_and_rewards(tmp_path, headers, sample):
    """It ends unflagged; and what is read can't be changed."""
    columns = {
        name: values
        for name, values in sample("transitions").items()
        if not name.startswith(("q.", "reward", "action_executed"))
    }
    columns["terminated"][-1] = False
    header = LogHeader("transitions", "t", {}, period=0.1)
    assert header.frames == {"wrench": "G", "action": "G", "ft_sensor": "S"}
    for name in ("b", "a"):
        LogWriter(tmp_path / name, header).write_episode(columns)
    logs = read_logs([tmp_path / "b", tmp_path / "a"])
    assert [log.folder.name for log in logs] == ["b", "a"]
    episode = logs[0].episodes[0]
    assert "q" not in episode
    assert not episode["terminated"].any() and not episode["truncated"].any()
    with pytest.raises(ValueError, match="read-only"):
        episode["time"][0] = 1.0


def test_csv_of_other_programs(written):
    """Byte order mark, CRLF, blanks, integers, and True with a capital."""
    path = written("transitions", "csv") / "episode_0000.csv"
    text = path.read_text().replace('"', "").replace(",", ", ")
    text = text.replace("true", "True").replace("false", "False")
    path.write_bytes(b"\xef\xbb\xbf" + text.replace("\n", "\r\n").encode())
    assert read_log(path.parent).episodes[0]["terminated"][-1]


def test_a_large_csv_that_begins_with_integers(tmp_path, headers):
    """Types are declared, not guessed from the first block of a file."""
    rows = 60_000
    q = np.zeros((rows, 3))
    q[-1] = 1 / 3
    columns = flat_columns("joint_motion", {"time": 0.01 * np.arange(rows), "q": q})
    LogWriter(tmp_path / "log", headers["joint_motion"], "csv").write_episode(columns)
    np.testing.assert_array_equal(read_log(tmp_path / "log").episodes[0]["q"], q)


def test_sensor_wrench_turns_into_the_sensors_frame(tmp_path):
    """Weight of 10 N; So's y axis up, so the sensor feels -10 N along y."""
    root = np.sqrt(0.5)
    R_WS = [[root, root, 0.0, 0.0]]
    logs = {}
    for frame, wrench in {
        "W": [[0.0, 0.0, -10.0, 0.0, 2.0, 0.0]],
        "S": [[0.0, -10.0, 0.0, 0.0, 0.0, -2.0]],
    }.items():
        folder = tmp_path / frame
        write_static_wrench(folder, R_WS, wrench, frame, "weigh", {})
        logs[frame] = read_log(folder)
    in_S = [sensor_wrench(log.header, log.episodes[0]) for log in logs.values()]
    np.testing.assert_allclose(in_S[0], in_S[1], atol=1e-14)


def test_rotation_matrices_against_drake(sample):
    """The oracle is Drake's own conversion."""
    math = pytest.importorskip("pydrake.math")
    quaternion = pytest.importorskip("pydrake.common.eigen_geometry").Quaternion
    columns = sample("static_wrench")
    wxyz = np.column_stack([columns[f"R_WS.q{c}"] for c in "wxyz"])
    expected = [math.RotationMatrix(quaternion(q)).matrix() for q in wxyz]
    np.testing.assert_allclose(rotation_matrices(1.00005 * wxyz), expected, atol=1e-14)
