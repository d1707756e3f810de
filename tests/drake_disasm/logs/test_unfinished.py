"""Rows that are on the disk as they come, and what becomes of them."""

import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drake_disasm.common.errors import DisasmError
from drake_disasm.logs import LogHeader, LogWriter, OpenEpisode, read_log
from tests.refusals import refused

ROOT = Path(__file__).parents[3]
Rows = list[tuple[dict[str, Any], dict[str, Any]]]
STEP = ("action", "action_executed", "reward.distance", "reward.force")
LEFT = ".episode_0000.unfinished.csv"


@pytest.fixture
def header(headers: dict[str, LogHeader]) -> LogHeader:
    """Of a log of transitions."""
    return headers["transitions"]


@pytest.fixture
def columns(sample: Callable[..., dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
    """An episode of 12 rows that no limit and no success has ended."""
    columns = sample("transitions")
    columns["terminated"] = np.zeros(12, dtype=bool)
    columns["reward.force"] += 0.0  # the sample's last one is -0.0
    return columns


def _append(
    episode: OpenEpisode, columns: dict[str, np.ndarray], rows: range | None = None
) -> None:
    """Appends rows as a recorder does: a step's columns with the row it led to."""
    for k in rows or range(len(columns["time"])):
        steps = [name for name in columns if name.startswith(STEP)]
        row = {name: columns[name][k] for name in columns if name not in steps}
        step = {name: columns[name][k - 1] if k else 0.0 for name in steps}
        episode.append(row, step)


def test_it_is_the_episode_that_is_written_at_once(tmp_path, header, columns):
    at_once, as_they_come = (LogWriter(tmp_path / n, header) for n in ("a", "b"))
    for _ in range(2):
        at_once.write_episode(columns)
        with as_they_come.begin_episode() as episode:
            _append(episode, columns)
    one, other = read_log(tmp_path / "a"), read_log(tmp_path / "b")
    assert one.data_hash == other.data_hash
    assert one.header == other.header
    names = {path.name for path in (tmp_path / "b").iterdir()}
    assert names == {"log.yaml", "episode_0000.parquet", "episode_0001.parquet"}


@pytest.mark.parametrize(("error", "reason"), [
    (DisasmError("the robot is held:\nforce"), "the robot is held: force"),
    (KeyboardInterrupt(), "interrupted by Ctrl-C"),
    (ValueError("no such state"), "ValueError('no such state')"),
])  # fmt: skip
def test_an_error_closes_it_and_is_the_reason(tmp_path, header, columns, error, reason):
    writer = LogWriter(tmp_path, header)
    with pytest.raises(type(error)), writer.begin_episode() as episode:
        _append(episode, columns, range(5))
        raise error
    log = read_log(tmp_path)
    assert log.header.notes == {0: {"cut_off": reason}} == writer.header.notes
    found = log.episodes[0]
    assert found.rows == 5
    assert found["truncated"][-1] and not found["terminated"].any()
    assert not found["action"][-1].any()
    for name, values in columns.items():
        kept = 4 if name.startswith((*STEP, "truncated")) else 5
        np.testing.assert_array_equal(found[name][:kept], values[:kept])


def test_an_episode_that_had_ended_is_not_cut_off(tmp_path, header, columns):
    columns["terminated"][-1] = True
    writer = LogWriter(tmp_path, header)
    with pytest.raises(DisasmError), writer.begin_episode() as episode:
        _append(episode, columns)
        raise DisasmError("too late")
    log = read_log(tmp_path)
    assert not log.header.notes and not log.episodes[0]["truncated"].any()


@pytest.mark.parametrize("rows", [0, 1])
def test_without_a_step_there_is_no_episode(tmp_path, header, columns, rows):
    writer = LogWriter(tmp_path, header)
    with pytest.raises(DisasmError), writer.begin_episode() as episode:
        _append(episode, columns, range(rows)) if rows else None
        raise DisasmError("the gripper slipped")
    writer.note(slipped_s=0.1)  # of nothing
    assert writer.next_number == 0 and not writer.header.notes
    assert [path.name for path in tmp_path.iterdir()] == ["log.yaml"]


def test_rows_after_one_that_was_not_measured_are_left_out(tmp_path, header, columns):
    columns["wrench.fz"][7] = np.nan
    writer = LogWriter(tmp_path, header)
    with pytest.raises(DisasmError), writer.begin_episode() as episode:
        _append(episode, columns)
        raise DisasmError("the sensor broke")
    found = read_log(tmp_path).episodes[0]
    assert found.rows == 7 and not found["action"][-1].any()
    np.testing.assert_array_equal(found["time"], columns["time"][:7])


WRITE_UNTIL_KILLED = """
import os, signal, sys
import numpy as np
from drake_disasm.logs import LogWriter, read_log

columns = read_log(sys.argv[1]).episodes[0].columns
header = read_log(sys.argv[1]).header
episode = LogWriter(sys.argv[2], header).begin_episode()
for k in range(6):
    episode.append({name: values[k] for name, values in columns.items()}, {})
print("written", flush=True)
sys.stdin.read()
"""


@pytest.fixture
def killed(tmp_path: Path, header: LogHeader, columns: dict[str, np.ndarray]) -> Path:
    """A log whose program was killed after six rows; looked at while it lived."""
    LogWriter(tmp_path / "sample", header).write_episode(columns)
    folder = tmp_path / "log"
    process = subprocess.Popen(
        [sys.executable, "-c", WRITE_UNTIL_KILLED, tmp_path / "sample", folder],
        cwd=ROOT,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    assert process.stdout and process.stdout.readline() == b"written\n"
    with refused("episode 0 is left out", "being recorded"):
        read_log(folder)
    with refused("another program", "wait for it"):
        LogWriter(folder, header, resume=True)
    process.kill()
    process.communicate()
    assert process.returncode == -signal.SIGKILL
    return folder


def test_the_next_start_closes_what_a_kill_cut_off(killed, header, columns):
    with refused("cut off by a kill", "resume"):
        read_log(killed)
    resumed = LogWriter(killed, header, resume=True)
    assert resumed.next_number == 1
    (remark,) = resumed.remarks
    assert "episode 0 was cut off: the program was killed" in remark
    log = read_log(killed)
    assert log.header.notes == {0: {"cut_off": "the program was killed"}}
    assert log.episodes[0].rows == 6 and log.episodes[0]["truncated"][-1]
    resumed.write_episode(columns)
    assert len(read_log(killed).episodes) == 2
    assert not list(killed.glob(".*"))


def test_half_a_line_is_left_out_and_a_damaged_one_is_named(killed, header):
    data = (killed / LEFT).read_bytes()
    (killed / LEFT).write_bytes(data.replace(b"0.1,", b"none,", 1))
    with refused("unfinished.csv: column 'time'"):
        LogWriter(killed, header, resume=True)
    (killed / LEFT).write_bytes(data[:-5])
    LogWriter(killed, header, resume=True)
    assert read_log(killed).episodes[0].rows == 5


def test_a_start_that_is_killed_while_it_closes_is_made_up_for(killed, header):
    """After the note, and after the episode, which are the places to be killed at."""
    rows = (killed / LEFT).read_bytes()
    LogWriter(killed, header, resume=True)
    log = read_log(killed)
    (killed / "episode_0000.parquet").unlink()
    (killed / LEFT).write_bytes(rows)
    assert LogWriter(killed, header, resume=True).remarks
    assert read_log(killed).data_hash == log.data_hash
    (killed / LEFT).write_bytes(rows)
    assert not LogWriter(killed, header, resume=True).remarks
    assert read_log(killed).data_hash == log.data_hash
    assert not list(killed.glob(".*"))


def test_wrong_columns_are_refused_at_the_first_row(tmp_path, header, columns):
    columns["wrnech.fx"] = columns.pop("wrench.fx")
    episode = LogWriter(tmp_path, header).begin_episode()
    with refused("missing column 'wrench.fx'"):
        _append(episode, columns)
    assert [path.name for path in tmp_path.iterdir()] == ["log.yaml"]


def test_notes_belong_to_the_newest_episode(tmp_path, header, columns):
    writer = LogWriter(tmp_path, header)
    writer.write_episode(columns)
    with writer.begin_episode() as episode:
        _append(episode, columns)
        writer.note(slipped_s=0.12)
    writer.note(held=3)
    expected = {1: {"slipped_s": 0.12, "held": 3}}
    assert read_log(tmp_path).header.notes == expected
    assert LogWriter(tmp_path, header, resume=True).header.notes == expected
    with refused("not plain data"):
        writer.note(load=np.zeros(6))
