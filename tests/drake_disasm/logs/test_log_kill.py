"""An episode is there whole or not at all."""

import contextlib
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from drake_disasm.logs import LogHeader, LogWriter, flat_columns, read_log
from tests.progress import running
from tests.refusals import refused

ROOT = Path(__file__).parents[3]
HEADER = LogHeader("joint_motion", "kill", {}, period=0.01, joints=("a", "b"))
ONE_ROW = flat_columns("joint_motion", {"time": [0.0], "q": [[0.0, 0.0]]})

WRITE_UNTIL_KILLED = """
import itertools, os, signal, sys
import numpy as np
from drake_disasm.logs import LogHeader, LogWriter, flat_columns

folder, file_format, kill_at = sys.argv[1], sys.argv[2], int(sys.argv[3])
header = LogHeader("joint_motion", "kill", {}, period=0.01, joints=("a", "b"))
writer = LogWriter(folder, header, file_format)
sync = os.fsync

def kill_before_rename(descriptor):
    if writer.next_number == kill_at:
        os.kill(os.getpid(), signal.SIGKILL)
    sync(descriptor)

os.fsync = kill_before_rename
for number in itertools.count():
    q = np.full((2000, 2), float(number))
    time = 0.01 * np.arange(2000)
    writer.write_episode(flat_columns("joint_motion", {"time": time, "q": q}))
"""


def _writing(
    folder: Path, file_format: str, kill_at: int
) -> contextlib.AbstractContextManager[subprocess.Popen[str]]:
    arguments = [str(folder), file_format, str(kill_at)]
    return running([sys.executable, "-c", WRITE_UNTIL_KILLED, *arguments], cwd=ROOT)


def _assert_whole(folder: Path) -> int:
    log = read_log(folder)
    for number, episode in enumerate(log.episodes):
        assert episode.name == f"episode_{number:04d}"
        np.testing.assert_array_equal(episode["q"], np.full((2000, 2), number))
    return len(log.episodes)


@pytest.mark.parametrize("file_format", ["parquet", "csv"])
def test_killed_between_writing_and_renaming(file_format, tmp_path):
    folder = tmp_path / "log"
    with _writing(folder, file_format, 3) as process:
        assert process.wait() == -signal.SIGKILL
    assert (folder / f".episode_0003.{file_format}.tmp").exists()
    assert _assert_whole(folder) == 3

    resumed = LogWriter(folder, HEADER, file_format, resume=True)
    assert resumed.next_number == 3
    q = np.full((2000, 2), 3.0)
    clock = 0.01 * np.arange(2000)
    resumed.write_episode(flat_columns("joint_motion", {"time": clock, "q": q}))
    assert _assert_whole(folder) == 4
    assert not list(folder.glob(".*"))


def test_a_kill_before_log_yaml_or_a_full_disk_leaves_nothing(tmp_path, monkeypatch):
    folder = tmp_path / "log"
    folder.mkdir()
    (folder / ".log.yaml.tmp").write_text("sche")  # counts as an empty folder
    writer = LogWriter(folder, HEADER)

    def full(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with refused("episode_0000", "No space", "check the disk"):
        writer.write_episode(ONE_ROW)
    assert [path.name for path in writer.folder.iterdir()] == ["log.yaml"]


def test_two_writers_do_not_overwrite(tmp_path):
    one = LogWriter(tmp_path / "log", HEADER)
    two = LogWriter(tmp_path / "log", HEADER, resume=True)
    one.write_episode(ONE_ROW)
    with refused("episode_0000", "another program", "folder"):
        two.write_episode(ONE_ROW)
