"""A motion as a table: what is read, and what is refused in one line."""

from pathlib import Path

import numpy as np
import pytest

from drake_disasm.free_motion.table import (
    MotionTable,
    read_motion,
    refuse_beyond_limits,
)
from drake_disasm.scenario import ArmConfig
from tests.refusals import refusal

_ARM = ArmConfig()


def written(path: Path, *lines: str) -> Path:
    path.write_text("\n".join(lines) + "\n")
    return path


def test_time_begins_at_zero_and_other_columns_are_left_out(tmp_path: Path) -> None:
    table = written(tmp_path / "m.csv", "q.1,time,v.0,q.0", "4,1.5,9,2", "5,1.75,9,3")
    motion = read_motion(table, 2)
    np.testing.assert_array_equal(motion.time, [0.0, 0.25])
    np.testing.assert_array_equal(motion.q, [[2.0, 4.0], [3.0, 5.0]])


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        (["time,q.0", "0,1", "1,1"], "no column 'q.1'"),
        (["time,q.0,q.1", "0,1,1"], "fewer than two rows"),
        (["time,q.0,q.1", "0,1,1", "1,,1"], "empty cell"),
        (["time,q.0,q.1", "0,1,1", "1,1,1", "1,2,2"], "increase at line 4"),
        (["time,q.0,q.1", "0,1,1", "1,x,1"], "column 'q.0'"),
        (["time,q.0,q.1", "0,1,1", "1,1"], "mixed lengths"),
    ],
)
def test_what_is_no_motion_is_refused(lines, words: str, tmp_path: Path) -> None:
    assert words in refusal(read_motion, written(tmp_path / "m.csv", *lines), 2)
    assert "excite" in refusal(read_motion, tmp_path / "none.csv", 7)


def test_what_the_joints_can_not_do_is_named() -> None:
    time, rest, path = np.array([0.0, 1.0]), np.zeros((2, 7)), Path("m.csv")
    refuse_beyond_limits(MotionTable(time, rest), _ARM, path)
    far, fast = rest.copy(), rest.copy()
    far[:, 3], fast[1, 6] = -2.5, 2.9
    for q, words in ((far, "m.csv: q.3 goes at -2.5 rad"), (fast, "q.6 moves at 2.9")):
        assert words in refusal(refuse_beyond_limits, MotionTable(time, q), _ARM, path)
