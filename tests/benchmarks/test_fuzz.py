"""benchmarks/fuzz.py: damaged files are refused, and what else comes is found."""

import os
import re
import tempfile
import time
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path

import fuzz
import numpy as np
import pytest
from fuzz_subjects import SUBJECTS, Subject

from drake_disasm.common.errors import DisasmError
from tests.tools.programs import run_program

#: A few cases of each reader and codec; the program itself reads thousands.
CASES = dict.fromkeys(fuzz.READERS, 40) | dict.fromkeys(fuzz.CODECS, 400)
CASES["import_mat"] = 10  # each starts a process


@pytest.fixture(autouse=True)
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Subjects leave their files to whoever says where temporary ones are."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))


@pytest.mark.parametrize("name", CASES)
def test_damage_is_refused_or_harmless(name: str) -> None:
    subject = SUBJECTS[name]()
    row = fuzz.Row(name)
    for number in range(CASES[name]):
        content = subject.make(np.random.default_rng([7, number]))
        row.add(number, fuzz.verdict(subject, content), 0.0)
    assert not row.failures
    assert row.refused > 0.2 * CASES[name]


@pytest.mark.parametrize("name", CASES)
def test_what_is_whole_is_accepted(name: str) -> None:
    """Else refusals would say nothing."""
    subject, accepted = SUBJECTS[name](), 0
    for number in range(CASES[name] * 5):
        content = subject.make(np.random.default_rng([8, number]))
        accepted += fuzz.verdict(subject, content) == "accepted"
        if accepted:
            return
    pytest.fail("nothing was accepted")


def test_all_subjects_are_in_the_table() -> None:
    assert {*fuzz.READERS, *fuzz.CODECS} == set(SUBJECTS)


def _raise(error: BaseException) -> Callable[[object], object]:
    def read(_: object) -> object:
        raise error

    return read


@pytest.mark.parametrize(
    ("read", "verdict"),
    [
        (len, "accepted"),
        (_raise(DisasmError("bad; mend it")), "refused"),
        (_raise(DisasmError("bad\nand worse")), "refused at length"),
        (_raise(DisasmError("bad" * 1000)), "refused at length"),
        (_raise(KeyError("a")), "KeyError: 'a'"),
        (_raise(MemoryError()), "MemoryError: "),
        (_raise(SystemExit(1)), "SystemExit: 1"),
    ],
)
def test_verdicts(read: Callable[[object], object], verdict: str) -> None:
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


def _hanging(job: fuzz.Job, folder: str, sender: Connection) -> None:
    """Reads the first case, and stays with the second; later ones go well."""
    sender.send("ready")
    for number in job.numbers:
        if number == 1:
            time.sleep(1e6)
        sender.send(("refused", 0.0))


def _dying(job: fuzz.Job, folder: str, sender: Connection) -> None:
    """Dies of the second case as of a fault in a library."""
    sender.send("ready")
    for number in job.numbers:
        if number == 1:
            os._exit(9)
        sender.send(("accepted", 0.0))


def test_a_case_that_hangs_is_named_and_the_rest_is_read() -> None:
    row = fuzz.fuzz("x", 0, 4, worker=_hanging, patience=0.2)
    assert row.failures == [(1, "hung for 0.2 s")]
    assert (row.tried, row.refused) == (4, 3)


def test_a_case_that_ends_the_process_is_named_and_the_rest_is_read() -> None:
    row = fuzz.fuzz("x", 0, 4, worker=_dying)
    assert row.failures == [(1, "ended the process (exit status 9)")]
    assert (row.tried, row.accepted) == (4, 3)


def test_the_program() -> None:
    done = run_program("fuzz", "--only", "hex_sample", "--datagrams", 50)
    assert done.returncode == 0, done.stderr
    assert re.search(r"\| hex_sample \| 50 \| \d+ \| \d+ \| 0 \|", done.stdout)
    done = run_program("fuzz", "--only", "hex_sample", "--case", 3)
    assert done.returncode == 0 and "hex_sample: " in done.stdout
    done = run_program("fuzz", "--only", "hex")
    assert done.returncode == 2 and "error: --only hex: no such reader" in done.stderr
