"""Running the programs: where they are, to their end, and up to Ctrl-C."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).parents[2]
Runner = Callable[..., subprocess.CompletedProcess[str]]


def command(name: str, *arguments: object) -> list[str]:
    """Returns the command that runs a program."""
    return [sys.executable, str(ROOT / f"tools/{name}.py"), *map(str, arguments)]


def run_program(name: str, *arguments: object) -> subprocess.CompletedProcess[str]:
    """Runs a program to its end."""
    return subprocess.run(
        command(name, *arguments), capture_output=True, text=True, timeout=280
    )


def interrupt(is_time: Callable[[], bool], name: str, *arguments: object) -> None:
    """Runs a program and presses Ctrl-C; it must say that what it has is kept."""
    process = subprocess.Popen(
        command(name, *arguments),
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    deadline = time.monotonic() + 200
    while not is_time():
        assert time.monotonic() < deadline and process.poll() is None
        time.sleep(0.02)
    os.kill(process.pid, signal.SIGINT)
    _, errors = process.communicate(timeout=100)
    assert process.returncode == 130 and "what was finished is kept" in errors
