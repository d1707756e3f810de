"""Writing files atomically: text, JSON, arrays, figures."""

import contextlib
import json
import os
import signal
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType
from typing import IO, TYPE_CHECKING, Any

import numpy as np

from drake_disasm.common.errors import DisasmError

if TYPE_CHECKING:
    from matplotlib.figure import Figure  # slow to import


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
    """Writes a text file, UTF-8; see `write_atomically`."""
    write_bytes(path, text.encode())


def write_bytes(path: Path, content: bytes) -> None:
    """Writes a binary file; see `write_atomically`."""
    write_atomically(path, lambda stream: stream.write(content))


def write_json(path: Path, content: Any, indent: int | None = 2) -> None:
    """Writes plain data as JSON; see `write_atomically`.

    Args:
        path: the file.
        content: dictionaries, lists, text and numbers.
        indent: spaces per level; None for one line.
    """
    write_text(path, json.dumps(content, indent=indent) + "\n")


def write_npz(path: Path, **arrays: Any) -> None:
    """Writes arrays under their names; see `write_atomically`."""
    write_atomically(path, lambda stream: np.savez(stream, **arrays))


def write_figure(path: Path, figure: "Figure", dpi: float = 120.0) -> None:
    """Writes a Matplotlib figure as PNG; see `write_atomically`."""
    write_atomically(path, lambda s: figure.savefig(s, format="png", dpi=dpi))


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
