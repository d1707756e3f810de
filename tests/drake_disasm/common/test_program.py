"""Progress of library calls on the terminal, and how a program is ended."""

import math
import os
import signal
import subprocess
import sys
from collections.abc import Sequence

import pytest

from drake_disasm.common import program, stopping
from drake_disasm.common.program import ProgressBar
from drake_disasm.common.progress import ProgressUpdate

_PRINTS = """
from drake_disasm.common import program

def main(arguments):
    for number in range(100_000):
        print(number)
    return 0

program.run(main)
"""


@pytest.fixture
def terminal(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch):
    """Has stderr say that it is a terminal; returns what was written."""
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    return capsys


def test_each_stage_has_a_bar_with_count_figure_and_remark(terminal) -> None:
    with ProgressBar(unit="episode", keep=True) as progress:
        progress(ProgressUpdate("fitting", 5))
        progress(ProgressUpdate("training", 0, 4))
        progress(ProgressUpdate("training", 3, 4, "2/3 solved", 12.345))
    last = terminal.readouterr().err.splitlines()[-1]
    for word in ("training", "3/4", "12.3", "2/3 solved", "episode"):
        assert word in last


def test_a_file_gets_a_line_now_and_then_and_the_last_of_a_stage_that_is_kept(
    capsys, monkeypatch
) -> None:
    now = [0.0]
    monkeypatch.setattr(program.time, "monotonic", lambda: now[0])
    for keep, kept in ((False, ""), (True, "fitting: 1000/4000 run\n")):
        with ProgressBar("run", keep) as progress:
            progress(ProgressUpdate("fitting", message="GroovePose: objective 12"))
            for done in range(1001):
                now[0] += 0.0625  # s
                value = 1.5 if done == 479 else math.nan
                progress(ProgressUpdate("fitting", done, 4000, value=value))
        lines = "fitting: 479/4000 run, 1.5\nfitting: 959/4000 run\n"
        assert capsys.readouterr() == ("GroovePose: objective 12\n", lines + kept)


def test_a_swallowed_ctrl_c_stops_at_the_next_update(monkeypatch) -> None:
    monkeypatch.setattr(stopping._stop, "error", KeyboardInterrupt())
    with ProgressBar() as progress, pytest.raises(KeyboardInterrupt):
        progress(ProgressUpdate("fitting", 1))


RUNS_UNTIL_STOPPED = """
import time
from drake_disasm.common import program

def main(arguments):
    try:
        print("begun", flush=True)
        while True:
            time.sleep(0.01)
    finally:
        print("tidied up", flush=True)

program.run(main)
"""


@pytest.mark.parametrize(
    ("number", "status", "words"),
    [(signal.SIGINT, 130, "interrupted"), (signal.SIGTERM, 143, "terminated")],
)
def test_a_program_that_is_stopped_tidies_up_and_says_so(number, status, words) -> None:
    process = _started(RUNS_UNTIL_STOPPED)
    assert process.stdout and process.stdout.readline() == "begun\n"
    process.send_signal(number)
    output, errors = process.communicate()
    assert process.returncode == status
    assert output == "tidied up\n"
    assert errors == f"{words}; what was finished is kept\n"


@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_a_program_whose_output_nobody_reads_ends_quietly(unbuffered: str) -> None:
    process = _started(_PRINTS, PYTHONUNBUFFERED=unbuffered)
    assert process.stdout and process.stderr
    assert process.stdout.readline() == "0\n"
    process.stdout.close()
    assert process.wait() == 141
    assert process.stderr.read() == ""


def test_another_broken_pipe_is_an_error(capfd) -> None:
    def breaks(_: Sequence[str]) -> int:
        raise BrokenPipeError("a worker's")

    with pytest.raises(BrokenPipeError, match="a worker's"):
        program.status(breaks, [])


def _started(code: str, **environment: str) -> subprocess.Popen[str]:
    """Returns a process of Python that runs some code and heeds Ctrl-C.

    A shell's background job ignores it, and so would what that starts.
    """
    return subprocess.Popen(
        [sys.executable, "-c", code],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | environment,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
