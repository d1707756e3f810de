"""Locks on files, which the system releases when their process dies."""

import fcntl
from typing import IO, Any


def lock(file: IO[Any]) -> None:
    """Locks an open file for this process alone, as soon as nobody else has it."""
    fcntl.flock(file, fcntl.LOCK_EX)


def try_lock(file: IO[Any]) -> bool:
    """Locks an open file for this process alone; returns whether it could.

    The lock lasts until the file is closed, or the process is gone, however it ends.
    """
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
