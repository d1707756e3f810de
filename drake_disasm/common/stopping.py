"""Ctrl-C and SIGTERM: each ends a program in one line, whatever it is doing."""

import contextlib
import multiprocessing
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from types import FrameType

EXIT_INTERRUPTED = 130
EXIT_TERMINATED = 143

#: After SIGTERM: s until workers are killed that finish what they do, and until the
#: process is, if it has not ended then.
_WORKERS_PATIENCE, _PATIENCE = 2.0, 4.5


class Terminated(KeyboardInterrupt):
    """SIGTERM came; a program ends by it as by Ctrl-C."""


class _Stop:
    """Remembers Ctrl-C or SIGTERM, since what is raised can get lost on its way.

    Python raises it wherever it happens to be; in a callback that some library calls
    from C++, or in a finaliser, it is printed or dropped there and the run goes on.
    """

    error: KeyboardInterrupt | None = None
    is_reported = False
    is_deferred = False

    def __call__(self, number: int, _: FrameType | None) -> None:
        is_ctrl_c = number == signal.SIGINT
        self.error = KeyboardInterrupt() if is_ctrl_c else Terminated("terminated")
        if not self.is_deferred:
            raise self.error


_stop = _Stop()


def handle_signals() -> None:
    """Has Ctrl-C and SIGTERM raise in this thread, the main one.

    What the parent process ignores stays ignored, as for a program in the background.
    """
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _stop)
    if signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
        signal.signal(signal.SIGTERM, _stop)
        _watch_for_sigterm()


def stop_if_interrupted() -> None:
    """Raises Ctrl-C or SIGTERM once more if it came; call it in a loop."""
    if _stop.error:
        raise _stop.error


@contextlib.contextmanager
def deferred() -> Iterator[None]:
    """Raises Ctrl-C or SIGTERM at the end of a block, and not within.

    For imports: extension modules make all kinds of errors and output of it.
    """
    _stop.is_deferred = True
    try:
        yield
    finally:
        _stop.is_deferred = False
    stop_if_interrupted()


def is_stopping() -> bool:
    """Returns whether Ctrl-C or SIGTERM came.

    Then another error is what a library made of it, such as "initialization failed".
    """
    return _stop.error is not None


def report() -> int:
    """Says once on stderr what ended the program; returns the exit status."""
    is_terminated = isinstance(_stop.error, Terminated)
    if not _stop.is_reported:
        _stop.is_reported = _stop.error is not None
        word = "terminated" if is_terminated else "interrupted"
        print(f"{word}; what was finished is kept", file=sys.stderr, flush=True)
    return EXIT_TERMINATED if is_terminated else EXIT_INTERRUPTED


def _watch_for_sigterm() -> None:
    """Starts a thread that sees SIGTERM when Python's handlers can't run.

    They run between two instructions of the main thread, and so not while that waits
    for a library in C++, nor when a callback there has dropped what they raised.
    """
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    signal.set_wakeup_fd(writer, warn_on_full_buffer=False)
    threading.Thread(target=_end_in_time, args=[reader], daemon=True).start()


def _end_in_time(reader: int) -> None:
    while os.read(reader, 1)[0] != signal.SIGTERM:
        pass
    time.sleep(_WORKERS_PATIENCE)
    for worker in multiprocessing.active_children():
        worker.kill()
    time.sleep(_PATIENCE - _WORKERS_PATIENCE)
    _stop.error = Terminated("terminated")
    os._exit(report())
