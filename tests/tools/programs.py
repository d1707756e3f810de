"""Running the programs: where they are, to their end, and up to Ctrl-C."""

import contextlib
import io
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import matplotlib.pyplot as plt
from drake_disasm_cli.main import main_of

from drake_disasm.common import program
from tests.progress import running, wait_until

ROOT = Path(__file__).parents[2]
Runner = Callable[..., subprocess.CompletedProcess[str]]


def command(name: str, *arguments: object) -> list[str]:
    """Returns the command that runs a program."""
    return [sys.executable, str(ROOT / f"tools/{name}.py"), *map(str, arguments)]


def run_program(
    name: str, *arguments: object, cwd: Path | None = None
) -> subprocess.CompletedProcess[str]:
    """Runs a program's main to its end, in this process.

    As the program itself would be run, less the seconds that a fresh interpreter takes
    to import Drake and PyTorch; `start_program` pays them.
    """
    words = [str(argument) for argument in arguments]
    out, err = io.StringIO(), io.StringIO()
    with (
        contextlib.chdir(cwd or Path.cwd()),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        code = _status(_main_of(name), words)
    plt.close("all")
    return subprocess.CompletedProcess(words, code, out.getvalue(), err.getvalue())


def _status(main: Callable[[Sequence[str]], int], words: Sequence[str]) -> int:
    """Returns the exit status; argparse exits by itself."""
    try:
        return program.status(main, words)
    except SystemExit as leaving:
        return leaving.code if isinstance(leaving.code, int) else 1


def _main_of(name: str) -> Callable[[Sequence[str]], int]:
    """Returns a subcommand's main."""
    return main_of(name.replace("_", "-"))


def start_program(
    name: str, *arguments: object, cwd: Path | None = None
) -> subprocess.CompletedProcess[str]:
    """Runs a program to its end as a user does: in an interpreter of its own."""
    return subprocess.run(
        command(name, *arguments),
        capture_output=True,
        text=True,
        cwd=cwd,
        check=False,
    )


def assert_one_line(
    done: subprocess.CompletedProcess[str], words: Sequence[str]
) -> None:
    """Checks that a program refused its input in one line that has these words."""
    assert done.returncode == 2, done.stderr
    lines = done.stderr.splitlines()
    errors = [line for line in lines if line.startswith("error: ")]
    assert len(errors) == 1 and "Traceback" not in done.stderr, done.stderr
    assert all(word in errors[0] for word in words), errors[0]


def interrupt(is_time: Callable[[], bool], name: str, *arguments: object) -> None:
    """Runs a program and presses Ctrl-C; it must say that what it has is kept."""
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with running(command(name, *arguments), **pipes) as process:
        wait_until(is_time, process)
        os.kill(process.pid, signal.SIGINT)
        _, errors = process.communicate()
    assert process.returncode == 130 and "what was finished is kept" in errors
