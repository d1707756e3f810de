"""Waiting that follows what is waited for: no test fails because a machine is slow.

A wait ends when what it waits for has come, or when it can't come any more. One that
would never end is ended by pytest-timeout, after half an hour (`pyproject.toml`).
"""

import contextlib
import signal
import subprocess
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Any

_PAUSE = 0.005  # s between two looks


def wait_until(
    condition: Callable[[], object], process: subprocess.Popen[str] | None = None
) -> None:
    """Waits for a condition, for as long as it may still come true.

    Args:
        condition: is looked at again and again.
        process: that brings it about; its end ends the wait.

    Raises:
        AssertionError: the process has ended, and the condition is not met.
    """
    while not condition():
        has_ended = process is not None and process.poll() is not None
        assert condition() or not has_ended, "the process ended before it came"
        time.sleep(_PAUSE)


def default_signals() -> None:
    """Lets a new process be interrupted, even if whoever runs the tests can't be."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)


@contextlib.contextmanager
def running(command: Sequence[str], **options: Any) -> Iterator[subprocess.Popen[str]]:
    """Yields a process with text streams; kills it if it is still there at the end.

    Args:
        command: that is run.
        options: of `subprocess.Popen`.
    """
    options = {"preexec_fn": default_signals} | options
    with subprocess.Popen(command, text=True, **options) as process:
        try:
            yield process
        finally:
            process.kill()
