"""benchmarks/fuzz.py: damaged files are refused, and what else comes is found."""

import re
import tempfile
from collections.abc import Callable
from pathlib import Path

import fuzz
import numpy as np
import pytest
from fuzz_subjects import SUBJECTS, Subject

from drake_disasm.common.errors import DisasmError
from tests.benchmarks.bad_workers import dying, hanging
from tests.refusals import refusal

#: A few cases of each reader and codec; the program itself reads thousands.
CASES = dict.fromkeys(fuzz.READERS, 12) | dict.fromkeys(fuzz.CODECS, 400)
CASES |= {"policy": 25, "checkpoint": 25, "import_mat": 3}  # each starts a process


@pytest.fixture(autouse=True)
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Subjects leave their files to whoever says where temporary ones are."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))


@pytest.mark.parametrize("name", CASES)
def test_damage_is_refused_or_harmless(name: str) -> None:
    """And what is whole is accepted, or refusals would say nothing."""
    subject, row = SUBJECTS[name](), fuzz.Row(name)
    for number in range(CASES[name]):
        content = subject.make(np.random.default_rng([7, number]))
        row.add(number, fuzz.verdict(subject, content), 0.0)
    assert not row.failures
    assert row.refused > 0.2 * CASES[name]
    more = (np.random.default_rng([8, n]) for n in range(CASES[name] * 5))
    if not row.accepted:
        assert any(fuzz.verdict(subject, subject.make(r)) == "accepted" for r in more)


def test_the_program_and_its_table(capsys: pytest.CaptureFixture[str]) -> None:
    assert {*fuzz.READERS, *fuzz.CODECS} == set(SUBJECTS)
    assert fuzz.main(["--only", "hex_sample", "--datagrams", "50"]) == 0
    shown = capsys.readouterr().out
    assert re.search(r"\| hex_sample \| 50 \| \d+ \| \d+ \| 0 \|", shown)
    assert fuzz.main(["--only", "hex_sample", "--case", "3"]) == 0
    assert "hex_sample: " in capsys.readouterr().out
    assert "--only hex: no such reader" in refusal(fuzz.main, ["--only", "hex"])


def _raise(error: BaseException) -> Callable[[object], object]:
    def read(_: object) -> object:
        raise error

    return read


def test_verdicts() -> None:
    for read, verdict in (
        (len, "accepted"),
        (_raise(DisasmError("bad; mend it")), "refused"),
        (_raise(DisasmError("bad\nand worse")), "refused at length"),
        (_raise(DisasmError("bad" * 1000)), "refused at length"),
        (_raise(KeyError("a")), "KeyError: 'a'"),
        (_raise(SystemExit(1)), "SystemExit: 1"),
    ):
        assert fuzz.verdict(Subject(lambda rng: b"", read), b"") == verdict


def test_slow_refusals_and_other_exceptions_are_counted() -> None:
    row = fuzz.Row("x")
    for number, (verdict, seconds) in enumerate(
        [("accepted", 9.0), ("refused", 0.1), ("refused", 3.0), ("KeyError: 'a'", 0.1)]
    ):
        row.add(number, verdict, seconds)
    assert (row.tried, row.accepted, row.refused) == (4, 1, 2)
    assert row.failures == [(2, "refused after 3.0 s"), (3, "KeyError: 'a'")]
    assert "| x | 4 | 1 | 2 | 1 | 3.00 s |" in row.text


@pytest.mark.parametrize(
    ("worker", "why"),
    [(hanging, "hung for 0.2 s"), (dying, "ended the process (exit status 9)")],
)
def test_a_case_that_hangs_or_dies_is_named_and_the_rest_is_read(worker, why) -> None:
    row = fuzz.fuzz("x", 0, 4, worker=worker, patience=0.2)
    assert row.failures == [(1, why)]
    assert (row.tried, row.refused + row.accepted) == (4, 3)
