"""Bad logs are refused by name: one line with file, column or key, and remedy."""

import os

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import yaml

from drake_disasm.logs import LogHeader, LogWriter, flat_columns, read_log, read_logs
from tests.refusals import refusal, refused


def _set(row, value):
    def change(column):
        column[row] = value
        return column

    return change


def _scale(factor):
    return lambda column: column * factor


def _drop(column):
    return None


def _as_text(column):
    return np.array([str(value) for value in column])


#: kind, column, what is done to it, words of the message: what is wrong, and remedy.
BAD_COLUMNS = [
    ("transitions", "wrench.fz", _drop, "missing column 'wrench.fz'", "add"),
    ("static_wrench", "order", _drop, "missing column 'order' or 'time'", "add"),
    ("joint_motion", "tau.2", _drop, "'tau.*' has 2 joints", "'tau.<i>' per joint"),
    ("transitions", "wrench.tx", _set(4, np.nan), "'wrench.tx' is NaN", "leave"),
    ("joint_motion", "v.0", _set(0, np.inf), "'v.0' is NaN, inf", "leave"),
    ("transitions", "X_GB_measured.qw", _scale(3), "'X_GB_measured.qw' to", "norm"),
    ("static_wrench", "R_WS.qx", _scale(2), "non-unit quaternion", "divide"),
    ("joint_motion", "time", _set(5, 1.5e9 + 0.04), "non-monotone", "row 5", "sort"),
    ("transitions", "time", _scale(1e3), "steps of 100 s", "period 0.1 s", "seconds"),
    ("transitions", "truncated", _set(3, True), "'truncated' is true in row 3", "end"),
    ("transitions", "action.dz", _set(-1, 0.001), "'action.dz' is 0.001", "write 0"),
    ("transitions", "reward.force", _set(-1, -1.0), "'reward.force' is -1", "write 0"),
    ("joint_motion", "tau.0", _as_text, "'tau.0'", "write a number"),
    # Magnitudes that nothing has.
    ("transitions", "wrench.fx", _set(3, 1e300), "1e+300 in row 3", "1e+07 N;", "SI"),
    ("joint_motion", "vd.2", _set(3, 1e300), "beyond 1e+09 rad/s"),
]


def _write_table(columns, path):
    pq.write_table(pa.table(columns), path)


@pytest.mark.parametrize(("kind", "column", "change", "words"), [
    (kind, column, change, words) for kind, column, change, *words in BAD_COLUMNS
])  # fmt: skip
def test_bad_columns(kind, column, change, words, written, sample, headers):
    """The reader and the writer refuse the same, and the writer leaves nothing."""
    folder = written(kind, "parquet")
    columns = sample(kind)
    changed = change(columns.pop(column))
    columns |= {} if changed is None else {column: changed}

    writer = LogWriter(folder.with_name("new"), headers[kind])
    with refused("episode_0000.parquet", *words):
        writer.write_episode(columns)
    assert [path.name for path in writer.folder.iterdir()] == ["log.yaml"]

    _write_table(columns, folder / "episode_0000.parquet")
    with refused(folder / "episode_0000.parquet", *words):
        read_log(folder)


@pytest.mark.parametrize(("kind", "column", "values", "words"), [
    ("joint_motion", "tau.1", np.zeros(11), ("mixed lengths: column 'tau.1'", "same")),
    ("joint_motion", "q.0", np.zeros((12, 2)), ("shape (12, 2)", "per row")),
    ("transitions", "terminated", np.zeros(12, int), ("'terminated'", "true or false")),
    ("static_wrench", "wrench.Fx", np.zeros(12), ("unknown", "mean 'wrench.fx'")),
])  # fmt: skip
def test_columns_that_are_not_written(
    kind, column, values, words, tmp_path, headers, sample
):
    writer = LogWriter(tmp_path / "log", headers[kind])
    with refused(*words):
        writer.write_episode(sample(kind) | {column: values})
    with refused("wrench", "(12, 5)", "give (rows, 6)"):
        flat_columns("transitions", {"wrench": np.zeros((12, 5))})


@pytest.mark.parametrize("values", [["a"] * 12, [[1.0]] * 12])
def test_columns_of_texts_and_lists_are_refused_unread(values, written, sample):
    folder = written("joint_motion", "parquet")
    columns = {**sample("joint_motion"), "q.0": pa.array(values)}
    _write_table(columns, folder / "episode_0000.parquet")
    with refused("column 'q.0' is of type", "write a number"):
        read_log(folder)


def _edit(line, cell, value):
    def change(text):
        rows = [row.split(",") for row in text.splitlines()]
        rows[line][cell : cell + 1] = value
        return "\n".join(",".join(row) for row in rows)

    return change


@pytest.mark.parametrize(("change", "words"), [
    (_edit(2, 1, ["abc"]), ("column 'q.0'", "'abc'", "write numbers")),
    (_edit(2, 1, [""]), ("column 'q.0' is NaN", "leave out")),
    (_edit(2, 1, []), ("rows of mixed lengths", "one cell per column")),
    (_edit(0, 2, ["q.0"]), ("column 'q.0' is there twice", "remove one")),
    (lambda text: text.replace(",", ";"), ("missing column 'time'", "add it")),
    (lambda text: "", ("missing column 'time'", "add it")),
    (lambda text: text.splitlines()[0], ("has 0 rows", "at least 1")),
    (lambda text: "x" * 200_000 + "\n1\n", ("not a table in CSV", "begin with")),
    (lambda text: "x," * 2**20, ("the first line has no end",)),
])  # fmt: skip
def test_bad_csv(change, words, written):
    path = written("joint_motion", "csv") / "episode_0000.csv"
    path.write_text(change(path.read_text()))
    with refused(path, *words):
        read_log(path.parent)


def test_bad_csv_of_transitions(written):
    """A flag that is empty, and one row, from which no step starts."""
    path = written("transitions", "csv") / "episode_0000.csv"
    text = path.read_text()
    path.write_text(text.replace(",false\n", ",\n", 1))
    with refused(path, "'truncated'", "true or false"):
        read_log(path.parent)
    path.write_text("\n".join([text.splitlines()[0], text.splitlines()[-1]]))
    with refused(path, "has 1 rows", "at least 2"):
        read_log(path.parent)


@pytest.mark.parametrize("change", [
    lambda data: b"PAR1 and no more",
    lambda data: data[:-100],
    lambda data: data.replace(b"tau.0", b"\xf7au.0"),  # a UnicodeDecodeError
])  # fmt: skip
def test_torn_parquet(change, written):
    path = written("joint_motion", "parquet") / "episode_0000.parquet"
    path.write_bytes(change(path.read_bytes()))
    with refused(path, "not a whole Parquet file", "write it again"):
        read_log(path.parent)


def test_a_parquet_file_of_more_values_than_memory(written, monkeypatch):
    """Runs of equal values take no room in a file, so that its size says nothing."""
    monkeypatch.setattr("drake_disasm.logs.tables.MOST_CELLS", 155)
    folder = written("joint_motion", "parquet")
    with refused(folder / "episode_0000.parquet", "156 values", "split it"):
        read_log(folder)
    monkeypatch.setattr("drake_disasm.logs.tables.MOST_CELLS", 156)
    assert read_log(folder).episodes


def test_many_columns_are_refused(written):
    path = written("joint_motion", "csv") / "episode_0000.csv"
    names = ["time", *(f"q.{i}" for i in range(10_000))]
    path.write_text(",".join(names) + "\n" + ",".join("0" * len(names)))
    with refused("10001 columns", "give 10000 at most"):
        read_log(path.parent)


_UNITS = {"time": "s", "length": "m", "angle": "rad", "force": "N", "torque": "Nm"}


#: kind, key, bad value (None removes the key), words of the message.
BAD_HEADERS = [
    ("transitions", "schema", "drake_disasm/log/2", "wrong schema", "convert"),
    ("transitions", "kind", "poses", "key 'kind' is 'poses'", "use one of"),
    ("transitions", "task", None, "missing key 'task'", "add it"),
    ("transitions", "task", 7, "key 'task' is 7", "give a text"),
    ("joint_motion", "provenance", "me", "'provenance'", "a mapping"),
    ("joint_motion", "joint", ["a"], "unknown key 'joint'", "'joints'"),
    ("transitions", "period", None, "missing key 'period'", "must say"),
    ("transitions", "period", "5e-3", "'period' is '5e-3'", "0.005"),
    ("joint_motion", "period", 0, "key 'period' is 0", "positive"),
    ("transitions", "period", 10**400, "'period'", "positive"),
    ("static_wrench", "period", 0.1, "key 'period'", "remove it"),
    ("joint_motion", "joints", None, "missing key 'joints'", "must say"),
    ("joint_motion", "joints", ["a", "a", "b"], "'joints'", "different names"),
    ("joint_motion", "urdf", ["arm"], "key 'urdf'", "give a text"),
    ("transitions", "scenario", [1], "key 'scenario'", "give a mapping"),
    ("static_wrench", "frames", {}, "'frames.wrench' is None", "S or W"),
    ("transitions", "frames", {"wrench": "W"}, "'frames.wrench'", "express"),
    ("static_wrench", "frames", {"wrench": "S", "x": "S"}, "'frames.x'", "only"),
    ("joint_motion", "units", _UNITS | {"length": "mm"}, "'mm'", "'length: m'"),
    ("joint_motion", "units", _UNITS | {"mass": "kg"}, "'units.mass'", "only"),
    ("transitions", "notes", [1], "key 'notes' is not a mapping", "write"),
    ("transitions", "notes", {-1: {}}, "key 'notes' is not a mapping", "write"),
    ("transitions", "notes", {0: "cut"}, "key 'notes' is not a mapping", "write"),
]  # fmt: skip


def _edit_header(folder, key, value):
    path = folder / "log.yaml"
    values = yaml.safe_load(path.read_text()) | {key: value}
    kept = {k: v for k, v in values.items() if v is not None}
    path.write_text(yaml.safe_dump(kept))
    return path


@pytest.mark.parametrize(("kind", "key", "value", "words"), [
    (kind, key, value, words) for kind, key, value, *words in BAD_HEADERS
])  # fmt: skip
def test_bad_headers(kind, key, value, words, written):
    folder = written(kind)
    path = _edit_header(folder, key, value)
    with refused(path, *words):
        read_log(folder)


def test_units_may_be_spelt_otherwise_and_values_in_messages_are_short(written):
    folder = written("transitions")
    _edit_header(folder, "units", _UNITS)
    assert read_log(folder).episodes
    path = _edit_header(folder, "task", list(range(3000)))
    assert len(refusal(read_log, folder)) < len(str(path)) + 300


@pytest.mark.parametrize(("text", "words"), [
    ("- 1\n- 2", "not a mapping"),
    ("\xff\xfe", ";"),
    ("a: " + "[" * 5000, "nested deeper"),
])  # fmt: skip
def test_log_yaml_that_is_no_header(text, words, written):
    path = written("joint_motion") / "log.yaml"
    path.write_bytes(text.encode("latin-1"))
    with refused(path, words):
        read_log(path.parent)


@pytest.mark.parametrize("name", ["log.yaml", "episode_0000.csv"])
def test_a_pipe_in_place_of_a_file_does_not_block(name, written):
    folder = written("transitions")
    (folder / name).unlink()
    os.mkfifo(folder / name)
    with refused(f"{folder / name}: is no regular file"):
        read_log(folder)


def test_folders_that_are_no_logs(tmp_path, written):
    with refused("none/log.yaml", "No such file"):
        read_log(tmp_path / "none")
    folder = written("joint_motion")
    (folder / "episode_0000.csv").unlink()
    with refused(folder, "no episode_0000", "at least one"):
        read_log(folder)
    with refused("no folder", "name at least one"):
        read_logs([])
    folders = [written("joint_response"), written("static_wrench")]
    with refused("static_wrench/log.yaml", "mixed kinds", "apart"):
        read_logs(folders)
    with refused("episode_0000.csv", "no column 'tau'", "measure"):
        read_log(folders[1]).episodes[0]["tau"]


@pytest.mark.parametrize(("name", "words"), [
    ("episode_0000.parquet", ("same episode", "remove one")),
    ("episode_1.csv", ("rename it",)),
    ("episode_0001.CSV", ("rename it",)),
])  # fmt: skip
def test_files_that_are_no_episodes(name, words, written):
    folder = written("joint_motion", "csv")
    (folder / name).touch()
    with refused(folder / name, *words):
        read_log(folder)


def test_columns_that_differ_between_episodes(written, sample, headers):
    folder = written("transitions", "parquet", episodes=2)
    columns = sample("transitions")
    del columns["reward.force"]
    _write_table(columns, folder / "episode_0001.parquet")
    words = ("column 'reward.force' is not in all episodes", "the same columns")
    with refused("episode_0001.parquet", *words):
        read_log(folder)
    resumed = LogWriter(folder, headers["transitions"], resume=True)
    with refused("episode_0002.parquet", *words):
        resumed.write_episode(columns)


def test_output_folders(tmp_path, headers, written):
    folder = written("joint_motion")
    header = headers["joint_motion"]
    with refused(folder, "not empty", "resume"):
        LogWriter(folder, header)
    other = LogHeader("joint_motion", "other", {}, period=0.01, joints=("a", "b", "c"))
    with refused(folder / "log.yaml", "key 'task'", "same header"):
        LogWriter(folder, other, resume=True)
    (tmp_path / "file").touch()
    with refused("file", "name another"):
        LogWriter(tmp_path / "file", header)
    (tmp_path / "alien").mkdir()
    (tmp_path / "alien" / "notes.txt").touch()
    with refused("alien/log.yaml"):
        LogWriter(tmp_path / "alien", header, resume=True)
    with refused("'xls'", "'parquet'"):
        LogWriter(tmp_path / "x", header, "xls")
    assert not (tmp_path / "x").exists()


def test_headers_are_checked_before_anything_is_written(tmp_path):
    header = LogHeader("joint_motion", "t", {"seed": np.int64(3)}, joints=("a",))
    with refused("log.yaml: not plain data", "give"):
        LogWriter(tmp_path / "log", header)
    with refused("'frames.wrench'", "S or W"):
        LogWriter(tmp_path / "log", LogHeader("static_wrench", "t", {}))
    assert not (tmp_path / "log").exists()
