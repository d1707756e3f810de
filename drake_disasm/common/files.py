"""Writing files whole or not at all."""

import contextlib
import os
import signal
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType
from typing import IO, Any

from drake_disasm.common.errors import DisasmError


def make_folder(folder: Path) -> None:
    """Makes a folder and its parents, if they are not there.

    Raises:
        DisasmError: the system refuses to.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise DisasmError(
            f"{folder}: no such folder can be made ({error.strerror}); name another"
        ) from error


def write_atomically(path: Path, write: Callable[[IO[bytes]], Any]) -> None:
    """Writes a file whole or not at all.

    The content goes to a hidden temporary file in the same folder, reaches the disk,
    and takes the file's name in one step. Ctrl-C waits until it is there.

    Args:
        path: the file.
        write: writes the content to the stream that it is given.

    Raises:
        DisasmError: the system refuses to write.
    """
    temporary = path.with_name(f".{path.name}.tmp")
    try:
        with _uninterrupted(), _removed_on_failure(temporary):
            with temporary.open("wb") as stream:
                write(stream)
                stream.flush()
                os.fsync(stream.fileno())
            os.replace(temporary, path)
        _sync_folder(path.parent)
    except OSError as error:
        raise DisasmError(
            f"{path}: cannot be written ({error.strerror}); check the disk's space "
            "and the folder's permissions"
        ) from error


def write_text(path: Path, text: str) -> None:
    """Writes a text file, UTF-8, whole or not at all; see `write_atomically`."""
    write_atomically(path, lambda stream: stream.write(text.encode()))


@contextlib.contextmanager
def _uninterrupted() -> Iterator[None]:
    """Puts Ctrl-C off to the end: libraries make other errors of it halfway."""
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or before is None:
        yield  # there it does not come
        return
    pressed: list[tuple[int, FrameType | None]] = []
    signal.signal(signal.SIGINT, lambda *caught: pressed.append(caught))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
    if pressed and callable(before):
        before(*pressed[0])


@contextlib.contextmanager
def _removed_on_failure(path: Path) -> Iterator[None]:
    try:
        yield
    except BaseException:
        path.unlink(missing_ok=True)
        raise


def _sync_folder(folder: Path) -> None:
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
