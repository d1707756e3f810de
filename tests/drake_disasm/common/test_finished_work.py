"""What is kept is found again bit for bit, and nothing is taken for something else."""

from pathlib import Path

import numpy as np
import pytest

from drake_disasm.common.finished_work import FinishedWork
from tests.refusals import refusal

IDENTITY = {"seed": 0, "config": {"rate": 0.1, "layers": (2, 3)}}


def test_results_come_back_bit_for_bit(tmp_path: Path) -> None:
    value = 0.1 + 0.2
    FinishedWork(tmp_path, IDENTITY).keep(["stage", [value, -0.0]], {"f": value / 3})
    again = FinishedWork(tmp_path, IDENTITY)
    assert again.get(["stage", [value, -0.0]]) == {"f": value / 3}
    assert again.get(["stage", [value, 0.0]]) is None
    work = FinishedWork()
    work.keep("a", 1)
    assert work.get("a") == 1 and work.get("b") is None


def test_arrays_are_found_once(tmp_path: Path) -> None:
    found = {"u": np.array([0.1, np.inf]), "huber": np.float64(3.0)}
    FinishedWork(tmp_path).arrays("key", lambda: found)
    again = FinishedWork(tmp_path).arrays("key", lambda: pytest.fail("again"))
    assert again["u"].tobytes() == found["u"].tobytes()
    assert float(again["huber"]) == 3.0
    other = {"u": np.zeros(1)}
    assert FinishedWork(tmp_path).arrays("another", lambda: other) is other


def test_half_a_line_of_a_killed_run_is_dropped(tmp_path: Path) -> None:
    FinishedWork(tmp_path).keep_all([("a", 1), ("b", 2)])
    path = tmp_path / "results.jsonl"
    path.write_text(path.read_text()[:-5])
    work = FinishedWork(tmp_path)
    assert work.get("a") == 1 and work.get("b") is None
    work.keep("c", 3)
    assert FinishedWork(tmp_path).get("c") == 3


def test_other_work_is_not_taken_up(tmp_path: Path) -> None:
    FinishedWork(tmp_path, IDENTITY)
    assert "`resume`" in refusal(FinishedWork, tmp_path, IDENTITY, False)
    other = {"seed": 0, "config": {"rate": 0.2, "layers": (2, 3)}}
    message = refusal(FinishedWork, tmp_path, other)
    assert "another config.rate (0.1, not 0.2)" in message
    (tmp_path / "other").mkdir()
    (tmp_path / "other/notes.txt").write_text("mine")
    message = refusal(FinishedWork, tmp_path / "other", IDENTITY, what="a study")
    assert "not empty and does not hold a study" in message


@pytest.mark.parametrize("line", ["{", '"key"', '{"key": 1}', "[" * 10**5])
def test_a_damaged_line_is_refused_and_nothing_is_lost(tmp_path, line: str) -> None:
    """Only what is behind the last line's end is what a killed run leaves."""
    FinishedWork(tmp_path).keep_all([("a", 1), ("b", 2)])
    path = tmp_path / "results.jsonl"
    whole = path.read_text()
    path.write_text(f"{line}\n{whole}")
    assert "results.jsonl: line 1 is damaged" in refusal(FinishedWork, tmp_path)
    assert path.read_text() == f"{line}\n{whole}"


@pytest.mark.parametrize("content", [b"", b"PK"])
def test_damaged_files_are_refused(tmp_path: Path, content: bytes) -> None:
    FinishedWork(tmp_path, IDENTITY).arrays("key", lambda: {"u": np.ones(3)})
    (kept,) = tmp_path.glob("*.npz")
    kept.write_bytes(content)
    work = FinishedWork(tmp_path, IDENTITY)
    assert "npz: is " in refusal(work.arrays, "key", dict)
    (tmp_path / "identity.json").write_bytes(content)
    assert "; name a new folder" in refusal(FinishedWork, tmp_path, IDENTITY)
