"""What is read of tables, datasets and bags, and what is refused."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pyarrow  # type: ignore[import-untyped]
import pyarrow.parquet  # type: ignore[import-untyped]
import pytest
from scipy.io import savemat

from drake_disasm.logs.importing import bags, guessed_map
from drake_disasm.logs.importing.source import read_source
from drake_disasm.stations.fake_cell.bag import FakeBag
from tests.refusals import refusal

_T = np.arange(5) * 0.1
_Q = np.arange(10.0).reshape(5, 2)


@pytest.mark.parametrize(
    "text",
    [
        "t,q,name\n0,1,a\n0.1,2,b\n",
        "t,q,joint 1 name of\n0,1,x\n0.1,2,x\n",
        "# from a drive\nt;q\n0;1\n0.1;2\n",
        "t\tq\n0\t1\n0.1\t2\n",
        "t q\n0 1\n0.1 2\n",
        "\ufefft,q,\n0,1,\n0.1,2,\n",
        "t;q\n0,0;1,0\n0,1;2,0\n",  # decimal commas
        "# t,q\n0,1\n0.1,2\n",  # as numpy.savetxt heads its tables
        "# made by me\n%t;q\n0,0;1\n0,1;2\n",
    ],
)
def test_csv_as_programs_write_it(tmp_path: Path, text: str) -> None:
    path = tmp_path / "run.csv"
    path.write_text(text, encoding="utf-8")
    [stream] = read_source(path).streams
    np.testing.assert_array_equal(stream.channels["t"], [0.0, 0.1])
    np.testing.assert_array_equal(stream.channels["q"], [1.0, 2.0])
    assert "name" not in stream.names


def test_a_column_of_csv_may_begin_otherwise_than_it_goes_on(tmp_path: Path) -> None:
    """Whole numbers, then others, megabytes later; and a flag among numbers."""
    path = tmp_path / "run.csv"
    rows = 100_000
    path.write_text("a,b,c\n" + "0,1,x\n" * rows + "0.5, true,\n")
    [stream] = read_source(path).streams
    assert stream.channels["a"][-1] == 0.5 and len(stream.channels["a"]) == rows + 1
    assert stream.channels["b"].tolist() == [1.0] * (rows + 1)
    assert "c" not in stream.names


def test_csv_without_names_and_with_flags_and_holes(tmp_path: Path) -> None:
    path = tmp_path / "run.txt"
    path.write_text("0,1\n1,2\n")
    assert read_source(path).streams[0].names == ["column_0", "column_1"]
    path.write_text("t,on\n0,true\n1,\n")
    source = read_source(path)
    np.testing.assert_array_equal(source.channel("on"), [1.0, np.nan])
    assert "no channel 'om'; it has on" in refusal(source.channel, "om")


def test_a_cell_that_is_no_number_is_missing(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    cells = ["n/a", *map(str, range(19)), ""]
    rows = [f"{i},{cell},{cell}" for i, cell in enumerate(cells)]
    path.write_text("t,q,tau\n# a comment\n\n" + "\n".join(rows[::-1]) + "\n")
    [stream] = read_source(path).streams
    assert np.isnan(stream.channels["q"]).sum() == 2
    assert stream.notes == tuple(
        f"{name}: 1 cell is no number: 'n/a' in line 24" for name in ("q", "tau")
    )


@pytest.mark.parametrize("kind", ["number", "date", "clock"])
def test_more_than_a_tenth_of_such_cells_are_text(tmp_path: Path, kind: str) -> None:
    way = {"number": "{}", "date": "2024-05-01 12:00:{:02}", "clock": "12:00:{:02}"}
    path, cells = tmp_path / "run.csv", [way[kind].format(i) for i in range(18)]
    for wrong, is_text in ((2, False), (3, True)):
        rows = [*cells, *["NULL"] * wrong]
        path.write_text("q,t\n" + "".join(f"1,{cell}\n" for cell in rows))
        [stream] = read_source(path).streams
        assert ("t" in stream.left_out) == is_text
        assert np.isnan(stream.channels.get("t", [np.nan] * 2)).sum() == 2
    assert (
        stream.left_out["t"] == "holds text in 3 of 21 cells, such as 'NULL' in line 20"
    )


@pytest.mark.parametrize(
    ("text", "labels", "skipped"),
    [
        ("A bench;;\nDate;2026-01-01;\nt;q;n\n0;1;2\n1;2;3\n", {}, 2),
        ("Bench 3, by me\nt,q,n\ns,deg,-\n0,1,2\n1,2,3\n", {"t": "t [s]"}, 1),
        ("t\tq\tn\ns\tdeg\t\n0,0\t1,0\t2\n1\t2\t3\n", {"t": "t [s]"}, 0),
        ("t,q,n,\n0,1,2,\n1,2,3,\n", {}, 0),
        ("t,q,n\nn/a,n/a,n/a\n" + "0,1,2\n1,2,3\n" * 5, {}, 0),
    ],
)
def test_names_are_above_the_numbers(
    tmp_path: Path, text: str, labels: dict[str, str], skipped: int
) -> None:
    path = tmp_path / "run.csv"
    path.write_text(text)
    [stream] = read_source(path).streams
    assert stream.names == ["t", "q", "n"]
    assert {n: v for n, v in stream.labels.items() if n == "t"} == labels
    assert [note for note in stream.notes if "above" in note] == [
        f"{skipped} line{'s' * (skipped > 1)} above the table skipped"
    ] * bool(skipped)
    assert stream.channels["q"][-2:].tolist() == [1.0, 2.0]


def test_a_first_row_of_numbers_is_no_header(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text("0,0,base,elbow,0.5,1.5,3\n0,8,base,elbow,0.6,1.6,4\n")
    [stream] = read_source(path).streams
    assert stream.is_unnamed and stream.channels["column_4"].tolist() == [0.5, 0.6]
    assert set(stream.left_out) == {"column_2", "column_3"}
    message = refusal(guessed_map, read_source(path), "joint_motion")
    assert "has no line of names" in message and "a map says what each is" in message


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
def test_encodings(tmp_path: Path, encoding: str) -> None:
    path = tmp_path / "run.txt"
    path.write_text("t [s]\tq [°]\n0,5\t1\n1\t2,5\n", encoding=encoding)
    [stream] = read_source(path).streams
    assert stream.channels["q [°]"].tolist() == [1.0, 2.5]
    is_noted = stream.notes == ("read as Windows-1252: no UTF-8",)
    assert is_noted == (encoding == "cp1252")


def test_times_of_day_go_on_at_midnight(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    path.write_text("t;q\n23:59:59,500;1\n0:00:00,250;2\n0:00:01;3\n")
    times = read_source(path).channel("t")
    np.testing.assert_allclose(times - times[0], [0.0, 0.75, 1.5], atol=1e-9)


def test_dates_and_times_are_seconds_since_1970(tmp_path: Path) -> None:
    path, expected = tmp_path / "run.csv", [1714564800.25, 1714564800.75]
    for first, second in (
        ("2024-05-01 12:00:00.25", "2024-05-01 12:00:00.75"),
        ("2024-05-01T12:00:00.25Z", "2024-05-01T12:00:00.75Z"),
        ("2024-05-01T14:00:00.25+02:00", "2024-05-01T14:00:00.75+02:00"),
    ):
        path.write_text(f"t,q\n{first},1\n{second},1\n")
        np.testing.assert_allclose(read_source(path).channel("t"), expected, rtol=1e-15)
    stamps = np.array(["2024-05-01T12:00:00"] * 2, dtype="datetime64[us]")
    np.savez(tmp_path / "run.npz", t=stamps, dt=stamps - stamps[0], q=[1.0, 2.0])
    source = read_source(tmp_path / "run.npz")
    assert source.channel("t").tolist() == [1714564800.0] * 2
    assert source.channel("dt").tolist() == [0.0, 0.0]


def test_archives_matlab_and_parquet_agree(tmp_path: Path) -> None:
    np.savez(tmp_path / "run.npz", t=_T, q=_Q, gain=2.5, word=np.array("x"))
    savemat(tmp_path / "run.mat", {"t": _T[:, None], "q": _Q.T, "gain": 2.5})
    table = pyarrow.table({"t": _T, "q": [list(row) for row in _Q]})
    pyarrow.parquet.write_table(table, tmp_path / "run.parquet")
    for ending in ("npz", "mat", "parquet"):
        [stream] = read_source(tmp_path / f"run.{ending}").streams
        assert stream.names == ["t", "q.0", "q.1"] or ending == "mat"
        np.testing.assert_array_equal(stream.channels["q.1"], _Q[:, 1])
        assert dict(stream.constants) == ({"gain": 2.5} if ending != "parquet" else {})
    np.save(tmp_path / "run.npy", _Q)
    names = read_source(tmp_path / "run.npy").streams[0].names
    assert names == ["column.0", "column.1"]


def test_arrays_of_several_lengths_are_streams_of_their_own(tmp_path: Path) -> None:
    slow, limits = np.arange(3.0), np.array([2.0, 1.0, 3.0, 0.0])
    arrays = {"t": _T, "q": _Q, "t_slow": slow, "temp": slow**2, "limits": limits}
    np.savez(tmp_path / "run.npz", **arrays)
    source = read_source(tmp_path / "run.npz")
    assert [stream.rows for stream in source.streams] == [5, 4, 3]
    assert source.stream_of("temp").names == ["t_slow", "temp"]
    # As many joints as rows and more: the clock tells which axis is which.
    savemat(tmp_path / "run.mat", {"t": _T[:3], "q": np.arange(21.0).reshape(3, 7)})
    [stream] = read_source(tmp_path / "run.mat").streams
    assert stream.channels["q.6"].tolist() == [6.0, 13.0, 20.0]


def test_what_is_left_out_is_named_with_the_reason(tmp_path: Path) -> None:
    arrays = {"t": _T, "q": _Q, "cube": np.zeros((4, 5, 2)), "who": np.array(["a"])}
    np.savez(tmp_path / "run.npz", **arrays)
    source = read_source(tmp_path / "run.npz")
    out = source.streams[0].left_out
    assert set(out) == {"cube", "who"} and "4 x 5 x 2" in out["cube"]
    assert "'cube' has 3 dimensions" in refusal(source.channel, "cube.0")
    (tmp_path / "run.csv").write_text("t,q,q,note\n0,1,2,a\n1,2,3,b\n")
    source = read_source(tmp_path / "run.csv")
    assert set(source.streams[0].left_out) == {"q", "note"}
    assert "'q' names 2 columns: rename one" in refusal(source.channel, "q")


def test_two_publishers_on_one_topic_are_parted(tmp_path: Path) -> None:
    bag, arm, hand = FakeBag(), ["a", "b"], ["finger"]
    for i in range(20):
        bag.add_joint_state(0.01 * (i + 1), arm, np.full(2, float(i)), np.zeros(2))
        if i % 5 == 0:
            bag.add_joint_state(
                0.01 * (i + 1.5), hand, np.full(1, float(i)), np.zeros(1)
            )
    bag.write(tmp_path / "bag", False)
    source = read_source(tmp_path / "bag")
    assert [stream.rows for stream in source.streams] == [20, 4]
    np.testing.assert_array_equal(
        source.channel("/joint_states:position.finger"), [0.0, 5.0, 10.0, 15.0]
    )


def test_a_lerobot_dataset_s_episodes_follow_each_other(tmp_path: Path) -> None:
    (tmp_path / "meta").mkdir()
    names = ["pan.pos", "lift.pos"]
    (tmp_path / "meta/info.json").write_text(
        json.dumps({"fps": 10, "features": {"observation.state": {"names": names}}})
    )
    (tmp_path / "data/chunk-000").mkdir(parents=True)
    for episode in (0, 1):
        state = {"timestamp": _T, "observation.state": [list(r) for r in _Q + episode]}
        table = pyarrow.table(state | {"episode_index": [episode] * 5})
        file = tmp_path / f"data/chunk-000/episode_{episode:06d}.parquet"
        pyarrow.parquet.write_table(table, file)
    [stream] = read_source(tmp_path).streams
    assert stream.rows == 10
    assert stream.labels["observation.state.1"] == "observation.state.lift.pos"
    np.testing.assert_array_equal(
        stream.channels["observation.state.0"], [*_Q[:, 0], *(_Q[:, 0] + 1)]
    )


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("run.xyz", b"1", "is of no known format"),
        ("run.npz", b"not a zip", "can't be read"),
        ("run.mat", b"not MATLAB" * 50, "can't be read"),
        ("run.mat", b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM", "with -v7"),
        ("run.parquet", b"PAR1", "can't be read"),
        ("run.mcap", b"\x89MCAP0\r\n", "can't be read"),
        ("run.csv", b"", "has no rows"),
        ("run.csv", b"t,q\n1,2\n1\n", "row 2 has 1 cells"),
        ("run.csv", b"a,b\nx,y\n", "has no columns of numbers"),
    ],
)
def test_what_can_t_be_read_is_refused(tmp_path, name, content, said) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    message = refusal(read_source, path)
    assert said in message and str(path) in message


def test_what_crashes_scipy_or_is_no_recording_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "run.mat"
    savemat(path, {"t": np.arange(4.0), "s": {"a": np.arange(3.0)}})
    content = bytearray(path.read_bytes())
    content[177] = 192  # of the length of a variable's name: a fault in SciPy 1.17.1
    path.write_bytes(content)
    assert "can't be read: " in refusal(read_source, path)
    assert "neither a ROS 2 bag" in refusal(read_source, tmp_path)
    assert "does not exist" in refusal(read_source, tmp_path / "none.csv")


def test_interfaces_of_a_joint_are_its_channels() -> None:
    """DynamicJointState holds a message for each joint."""

    @dataclasses.dataclass
    class Interface:
        interface_names: list[str]
        values: np.ndarray

    @dataclasses.dataclass
    class State:
        joint_names: list[str]
        interface_values: list[Interface]

    joint = Interface(["position", "effort"], np.array([0.5, 2.0]))
    found = dict(bags._numbers(State(["elbow"], [joint]), ""))
    assert found == {
        "interface_values.elbow.values.position": 0.5,
        "interface_values.elbow.values.effort": 2.0,
    }
