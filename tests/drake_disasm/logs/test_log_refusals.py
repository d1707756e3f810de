"""Bad logs are refused by name: one line with file, column or key, and remedy."""

import os
import time

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import yaml

from drake_disasm.common.errors import DisasmError
from drake_disasm.logs import LogHeader, LogWriter, read_log, read_logs


def _refused(call, *words):
    """Runs the call, which must raise one line with all the words in it."""
    with pytest.raises(DisasmError) as caught:
        call()
    message = str(caught.value)
    assert "\n" not in message
    for word in words:
        assert word in message, message


def _set(column, row, value):
    def change(columns):
        columns[column][row] = value

    return change


def _drop(column):
    return lambda columns: columns.pop(column)


def _add(column):
    def change(columns):
        columns[column] = np.zeros(12)

    return change


def _shorten(column):
    def change(columns):
        columns[column] = columns[column][:-1]

    return change


def _as_text(column):
    def change(columns):
        columns[column] = np.array([str(v) for v in columns[column]])

    return change


def _scale(column, factor):
    def change(columns):
        columns[column] = columns[column] * factor

    return change


# kind, what is done to good columns, words of the message: column and remedy.
BAD_COLUMNS = {
    "missing": ("transitions", _drop("wrench.fz"), "missing column 'wrench.fz'", "add"),
    "missing_optional_part": (
        "transitions",
        _drop("action_executed.dv"),
        "missing column 'action_executed.dv'",
        "add",
    ),
    "missing_joint": ("joint_motion", _drop("q.1"), "missing column 'q.1'", "add"),
    "missing_flag": ("transitions", _drop("truncated"), "'truncated'", "add"),
    "missing_order": (
        "static_wrench",
        _drop("order"),
        "missing column 'order' or 'time'",
        "add",
    ),
    "unknown": (
        "static_wrench",
        _add("wrench.Fx"),
        "unknown column 'wrench.Fx'",
        "did you mean 'wrench.fx'",
    ),
    "joints_of_torque": (
        "joint_motion",
        _drop("tau.2"),
        "mixed lengths: column 'tau.*' has 2 joints",
        "one column 'tau.<i>' per joint",
    ),
    "nan": ("transitions", _set("wrench.tx", 4, np.nan), "'wrench.tx' is NaN", "leave"),
    "infinite": ("joint_motion", _set("v.0", 0, np.inf), "'v.0' is NaN, inf", "leave"),
    "non_unit": (
        "transitions",
        _scale("X_GB_measured.qw", 3.0),
        "column 'X_GB_measured.qw' to",
        "non-unit quaternion",
        "divide it by its norm",
    ),
    "non_unit_static": ("static_wrench", _scale("R_WS.qx", 2), "'R_WS.qw' to", "norm"),
    "time_repeats": (
        "joint_motion",
        _set("time", 5, 1.5e9 + 0.04),
        "column 'time' is non-monotone",
        "row 5",
        "sort the rows",
    ),
    "order_falls": (
        "static_wrench",
        _set("order", 2, 0),
        "'order' is non-mono",
        "sort",
    ),
    "milliseconds": (
        "transitions",
        _scale("time", 1e3),
        "column 'time' has steps of 100 s",
        "period 0.1 s",
        "time in seconds",
    ),
    "ends_early": (
        "transitions",
        _set("truncated", 3, True),
        "column 'truncated' is true in row 3",
        "end the table there",
    ),
    "last_action": (
        "transitions",
        _set("action.dz", -1, 0.001),
        "column 'action.dz' is 0.001 in the last row",
        "write 0",
    ),
    "last_reward": (
        "transitions",
        _set("reward.force", -1, -1.0),
        "column 'reward.force' is -1 in the last row",
        "write 0",
    ),
    "text": ("joint_motion", _as_text("tau.0"), "'tau.0'", "write a number"),
}


def _write_table(columns, path):
    pq.write_table(pa.table(columns), path)


@pytest.mark.parametrize("case", BAD_COLUMNS)
def test_bad_columns(case, written, sample, headers):
    """The reader and the writer refuse the same, and the writer leaves nothing."""
    kind, change, *words = BAD_COLUMNS[case]
    folder = written(kind, "parquet")
    columns = sample(kind)
    change(columns)

    writer = LogWriter(folder.with_name("new"), headers[kind])
    _refused(lambda: writer.write_episode(columns), "episode_0000.parquet", *words)
    assert [path.name for path in writer.folder.iterdir()] == ["log.yaml"]

    _write_table(columns, folder / "episode_0000.parquet")
    _refused(lambda: read_log(folder), str(folder / "episode_0000.parquet"), *words)


def test_mixed_lengths_of_arrays(tmp_path, headers, sample):
    columns = sample("joint_motion")
    _shorten("tau.1")(columns)
    writer = LogWriter(tmp_path / "log", headers["joint_motion"])
    _refused(
        lambda: writer.write_episode(columns),
        "episode_0000.parquet: mixed lengths: column 'tau.1' has 11 rows",
        "same number of rows",
    )


def test_matrix_as_a_column(tmp_path, headers, sample):
    columns = sample("joint_motion") | {"q.0": np.zeros((12, 2))}
    writer = LogWriter(tmp_path / "log", headers["joint_motion"])
    _refused(
        lambda: writer.write_episode(columns), "'q.0' has shape (12, 2)", "per row"
    )


def test_flags_are_boolean(tmp_path, headers, sample):
    columns = sample("transitions")
    columns["terminated"] = columns["terminated"].astype(int)
    writer = LogWriter(tmp_path / "log", headers["transitions"])
    _refused(lambda: writer.write_episode(columns), "'terminated'", "true or false")


def test_too_few_rows(written):
    folder = written("transitions")
    lines = (folder / "episode_0000.csv").read_text().splitlines()
    (folder / "episode_0000.csv").write_text("\n".join([lines[0], lines[-1]]))
    _refused(lambda: read_log(folder), "episode_0000.csv", "has 1 rows", "at least 2")
    (folder / "episode_0000.csv").write_text(lines[0])
    _refused(lambda: read_log(folder), "episode_0000.csv", "has 0 rows", "at least 2")


def _edit(line, cell, value):
    def change(text):
        rows = [row.split(",") for row in text.splitlines()]
        rows[line][cell : cell + 1] = value
        return "\n".join(",".join(row) for row in rows)

    return change


BAD_CSV = {
    "text": (_edit(2, 1, ["abc"]), "column 'q.0'", "'abc'", "write numbers"),
    "empty_cell": (_edit(2, 1, [""]), "column 'q.0' is NaN", "leave out"),
    "nan": (_edit(2, 1, ["nan"]), "column 'q.0' is NaN", "leave out"),
    "short_row": (_edit(2, 1, []), "rows of mixed lengths", "one cell per column"),
    "long_row": (_edit(2, 1, ["1", "2"]), "rows of mixed lengths", "one cell per"),
    "twice": (_edit(0, 2, ["q.0"]), "column 'q.0' is there twice", "remove one"),
    "semicolons": (lambda t: t.replace(",", ";"), "missing column 'time'", "add it"),
    "empty": (lambda t: "", "missing column 'time'", "add it"),
}


@pytest.mark.parametrize("case", BAD_CSV)
def test_bad_csv(case, written):
    change, *words = BAD_CSV[case]
    path = written("joint_motion", "csv") / "episode_0000.csv"
    path.write_text(change(path.read_text()))
    _refused(lambda: read_log(path.parent), str(path), *words)


def test_empty_flag_in_csv(written):
    path = written("transitions", "csv") / "episode_0000.csv"
    path.write_text(path.read_text().replace(",false\n", ",\n", 1))
    _refused(lambda: read_log(path.parent), str(path), "'truncated'", "true or false")


@pytest.mark.parametrize("content", [b"", b"PAR1 and no more"])
def test_torn_parquet(content, written):
    path = written("joint_motion", "parquet") / "episode_0000.parquet"
    path.write_bytes(content or path.read_bytes()[:-100])
    _refused(lambda: read_log(path.parent), str(path), "Parquet", "write it again")


# kind, key, bad value (None removes the key), words of the message.
BAD_HEADERS = {
    "schema": (
        "transitions",
        "schema",
        "drake_disasm/log/2",
        "wrong schema",
        "convert",
    ),
    "no_schema": ("transitions", "schema", None, "wrong schema", "convert"),
    "kind": ("transitions", "kind", "poses", "key 'kind' is 'poses'", "use one of"),
    "no_task": ("transitions", "task", None, "missing key 'task'", "add it"),
    "task": ("transitions", "task", 7, "key 'task' is 7", "give a text"),
    "no_provenance": ("joint_motion", "provenance", None, "'provenance'", "add it"),
    "provenance": ("joint_motion", "provenance", "me", "'provenance'", "a mapping"),
    "no_units": ("joint_motion", "units", None, "missing key 'units'", "add it"),
    "unknown": ("joint_motion", "joint", ["a"], "unknown key 'joint'", "'joints'"),
    "no_period": ("transitions", "period", None, "missing key 'period'", "must say"),
    "text_period": ("transitions", "period", "5e-3", "'period' is '5e-3'", "0.005"),
    "zero_period": ("joint_motion", "period", 0, "key 'period' is 0", "positive"),
    "static_period": ("static_wrench", "period", 0.1, "key 'period'", "remove it"),
    "no_joints": ("joint_motion", "joints", None, "missing key 'joints'", "must say"),
    "joints": (
        "joint_motion",
        "joints",
        ["a", "a", "b"],
        "'joints'",
        "different names",
    ),
    "urdf": ("joint_motion", "urdf", ["arm"], "key 'urdf'", "give a text"),
    "scenario": ("transitions", "scenario", [1], "key 'scenario'", "give a mapping"),
    "no_frame": ("static_wrench", "frames", {}, "'frames.wrench' is None", "S or W"),
    "frame": ("transitions", "frames", {"wrench": "W"}, "'frames.wrench'", "express"),
    "odd_frame": (
        "static_wrench",
        "frames",
        {"wrench": "S", "wrist": "S"},
        "unknown key 'frames.wrist'",
        "state 'wrench' only",
    ),
}


def _edit_header(folder, key, value):
    path = folder / "log.yaml"
    values = yaml.safe_load(path.read_text())
    values[key] = value
    kept = {k: v for k, v in values.items() if v is not None}
    path.write_text(yaml.safe_dump(kept))
    return path


@pytest.mark.parametrize("case", BAD_HEADERS)
def test_bad_headers(case, written):
    kind, key, value, *words = BAD_HEADERS[case]
    folder = written(kind)
    path = _edit_header(folder, key, value)
    _refused(lambda: read_log(folder), str(path), *words)


@pytest.mark.parametrize(
    ("quantity", "unit", "si"),
    [("length", "mm", "m"), ("angle", "deg", "rad"), ("torque", "N·mm", "N·m")],
)
def test_units_that_are_not_si(quantity, unit, si, written):
    folder = written("joint_motion")
    units = {"time": "s", "length": "m", "angle": "rad", "force": "N", "torque": "Nm"}
    path = _edit_header(folder, "units", units | {quantity: unit})
    _refused(
        lambda: read_log(folder),
        str(path),
        f"key 'units.{quantity}' is '{unit}'",
        f"convert the columns to SI and write '{quantity}: {si}'",
    )
    _edit_header(folder, "units", units | {"mass": "kg"})
    _refused(lambda: read_log(folder), "unknown key 'units.mass'", "only")
    _edit_header(folder, "units", units)
    assert read_log(folder).episodes


@pytest.mark.parametrize("text", ["a: [1", "- 1\n- 2", "", "\xff\xfe"])
def test_log_yaml_that_is_no_mapping(text, written):
    folder = written("joint_motion")
    (folder / "log.yaml").write_bytes(text.encode("latin-1"))
    _refused(lambda: read_log(folder), str(folder / "log.yaml"), ";")


def test_folders_that_are_no_logs(tmp_path, written):
    _refused(lambda: read_log(tmp_path / "none"), "none/log.yaml", "No such file")
    folder = written("joint_motion")
    (folder / "episode_0000.csv").unlink()
    _refused(lambda: read_log(folder), str(folder), "no episode_0000", "at least one")
    _refused(lambda: read_logs([]), "no folder", "name at least one")


def test_same_number_twice(written):
    folder = written("joint_motion", "csv")
    (folder / "episode_0000.parquet").touch()
    _refused(lambda: read_log(folder), "episode_0000", "same episode", "remove one")


@pytest.mark.parametrize("name", ["episode_1.csv", "episode_0001.CSV", "episode_a.csv"])
def test_names_that_are_nearly_episodes(name, written):
    folder = written("joint_motion", "csv")
    (folder / name).touch()
    _refused(lambda: read_log(folder), str(folder / name), "rename it")


def test_a_parquet_column_whose_name_is_no_text(written):
    """PyArrow raises a UnicodeDecodeError, which is none of its own."""
    path = written("joint_motion", "parquet") / "episode_0000.parquet"
    path.write_bytes(path.read_bytes().replace(b"tau.0", b"\xf7au.0"))
    _refused(lambda: read_log(path.parent), "not a whole Parquet file", "write it")


def test_columns_that_differ_between_episodes(written, sample, headers):
    folder = written("transitions", "parquet", episodes=2)
    columns = sample("transitions")
    del columns["reward.force"]
    _write_table(columns, folder / "episode_0001.parquet")
    words = ("column 'reward.force' is not in all episodes", "the same columns")
    _refused(lambda: read_log(folder), "episode_0001.parquet", *words)
    resumed = LogWriter(folder, headers["transitions"], resume=True)
    _refused(lambda: resumed.write_episode(columns), "episode_0002.parquet", *words)


def test_mixed_kinds(written):
    folders = [written("joint_motion"), written("static_wrench")]
    _refused(
        lambda: read_logs(folders), "static_wrench/log.yaml", "mixed kinds", "apart"
    )


def test_a_quantity_that_was_not_measured(written):
    episode = read_log(written("static_wrench")).episodes[0]
    _refused(lambda: episode["tau"], "episode_0000.csv", "no column 'tau'", "measure")


def test_output_folders(tmp_path, headers, written):
    folder = written("joint_motion")
    header = headers["joint_motion"]
    _refused(lambda: LogWriter(folder, header), str(folder), "not empty", "resume")
    other = LogHeader("joint_motion", "other", {}, period=0.01, joints=("a", "b", "c"))
    _refused(
        lambda: LogWriter(folder, other, resume=True),
        str(folder / "log.yaml"),
        "key 'task'",
        "same header",
    )
    (tmp_path / "file").touch()
    _refused(lambda: LogWriter(tmp_path / "file", header), "file", "name another")
    (tmp_path / "alien").mkdir()
    (tmp_path / "alien" / "notes.txt").touch()
    _refused(
        lambda: LogWriter(tmp_path / "alien", header, resume=True), "alien/log.yaml"
    )
    _refused(lambda: LogWriter(tmp_path / "x", header, "xls"), "'xls'", "'parquet'")
    assert not (tmp_path / "x").exists()


def test_headers_are_checked_before_anything_is_written(tmp_path):
    header = LogHeader("joint_motion", "t", {"seed": np.int64(3)}, joints=("a",))
    folder = tmp_path / "log"
    _refused(lambda: LogWriter(folder, header), "log.yaml: not plain data", "give")
    header = LogHeader("static_wrench", "t", {})
    _refused(lambda: LogWriter(folder, header), "'frames.wrench'", "S or W")
    assert not folder.exists()


def _words_of_header(folder, text, *words):
    path = folder / "log.yaml"
    path.write_text(text)
    _refused(lambda: read_log(folder), str(path), *words)


BOMB = "a0: &a0 [x]\n" + "".join(
    f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]\n" for i in range(1, 10)
)
#: What stood in a header, and what is said about it.
HOSTILE_HEADERS = {
    "date": ("date: 2020-13-45", "not YAML (month must be"),
    "nesting": ("a: " + "[" * 5000, "nested deeper"),
    "aliases": (f"{BOMB}task: *a9", "aliases written out"),
    "list of kinds": ("schema: drake_disasm/log/1\nkind: [transitions]", "missing key"),
}


@pytest.mark.parametrize("case", HOSTILE_HEADERS)
def test_headers_that_could_keep_a_reader_busy(case, written):
    text, *words = HOSTILE_HEADERS[case]
    _words_of_header(written("transitions"), text, *words)


@pytest.mark.parametrize(
    ("key", "value"),
    [("kind", ["transitions"]), ("period", 10**400), ("task", list(range(3000)))],
)
def test_values_in_messages_are_short(key, value, written):
    folder = written("transitions")
    path = _edit_header(folder, key, value)
    with pytest.raises(DisasmError) as caught:
        read_log(folder)
    message = str(caught.value)
    assert message.startswith(f"{path}: ") and f"'{key}'" in message
    assert "\n" not in message and len(message) < len(str(path)) + 300


def _pipe(path):
    path.unlink()
    os.mkfifo(path)


@pytest.mark.parametrize("name", ["log.yaml", "episode_0000.csv"])
def test_a_pipe_in_place_of_a_file_does_not_block(name, written):
    folder = written("transitions")
    _pipe(folder / name)
    _refused(lambda: read_log(folder), f"{folder / name}: is no regular file")


def test_a_cell_longer_than_the_csv_reader_takes(written):
    path = written("joint_motion") / "episode_0000.csv"
    path.write_text("x" * 200_000 + "\n1\n")
    _refused(lambda: read_log(path.parent), "not a table in CSV", "begin with column")
    path.write_text("x," * 2**20)
    _refused(lambda: read_log(path.parent), "the first line has no end")


@pytest.mark.parametrize("file_format", ["csv", "parquet"])
def test_many_columns_are_refused_at_once(file_format, written):
    """Looking each one up among all of them took minutes."""
    path = written("joint_motion", file_format) / f"episode_0000.{file_format}"
    names = ["time", *(f"q.{i}" for i in range(30_000))]
    if file_format == "csv":
        path.write_text(",".join(names) + "\n" + ",".join("0" * len(names)))
    else:
        _write_table(dict.fromkeys(names, np.zeros(1)), path)
    begun = time.process_time()
    _refused(lambda: read_log(path.parent), "30001 columns", "give 10000 at most")
    assert time.process_time() - begun < 2.0
    if file_format == "csv":
        path.write_text(",".join(names[:9000]) + "\n" + ",".join("0" * 9000))
        begun = time.process_time()
        _refused(lambda: read_log(path.parent), "mixed lengths: column 'q.*' has 8999")
        assert time.process_time() - begun < 2.0


MAGNITUDES = {
    "wrench.fx": ("transitions", 1e300, "beyond 1e+07 N;"),
    "ft_sensor.tz": ("transitions", -1e9, "beyond 1e+07 N\N{MIDDLE DOT}m;"),
    "X_GB_measured.x": ("transitions", 1e200, "beyond 10000 m;"),
    "X_GB_commanded.qw": ("transitions", 1e200, "beyond 1e+20 1;"),
    "action.dw": ("transitions", 1e7, "beyond 1e+06 rad;"),
    "q.1": ("joint_motion", 1e300, "beyond 1e+06 rad;"),
    "vd.2": ("joint_motion", 1e300, "beyond 1e+09 rad/s"),
}


@pytest.mark.parametrize("column", MAGNITUDES)
def test_magnitudes_that_nothing_has(column, written, sample):
    kind, value, *words = MAGNITUDES[column]
    folder, columns = written(kind, "parquet"), sample(kind)
    columns[column][3] = value
    _write_table(columns, folder / "episode_0000.parquet")
    words = (f"column '{column}' is {value:g} in row 3", *words, "convert it to SI")
    _refused(lambda: read_log(folder), *words)


def test_a_parquet_file_of_more_rows_than_memory(written, sample):
    """Runs of equal values take no room in the file."""
    path = written("joint_motion", "parquet") / "episode_0000.parquet"
    table = pa.table({name: np.zeros(2**20) for name in sample("joint_motion")})
    with pq.ParquetWriter(path, table.schema, compression="zstd") as writer:
        for _ in range(20):
            writer.write_table(table, row_group_size=2**20)
    _refused(lambda: read_log(path.parent), "272629760 values", "split it")


@pytest.mark.parametrize("column", [["a"] * 12, [[1.0]] * 12, [{"a": 1}] * 12])
def test_columns_of_texts_and_lists_are_refused_unread(column, written, sample):
    path = written("joint_motion", "parquet") / "episode_0000.parquet"
    table = pa.table({**sample("joint_motion"), "q.0": pa.array(column)})
    pq.write_table(table, path)
    _refused(lambda: read_log(path.parent), "column 'q.0' is of type", "write a number")
