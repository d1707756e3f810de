"""Writing files atomically, and reading them within limits."""

import contextlib
import json
import os
import signal
import stat
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType
from typing import IO, TYPE_CHECKING, Any

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.plain_data import check_like
from drake_disasm.common.text import clipped

if TYPE_CHECKING:
    from matplotlib.figure import Figure  # slow to import

_MOST_JSON = 2**28  # bytes


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


def read_bytes(path: Path, remedy: str, most: int) -> bytes:
    """Returns the content of a file.

    Args:
        path: of a regular file: a pipe or a device could block for ever.
        remedy: for messages.
        most: bytes that it may have.

    Raises:
        DisasmError: it can't be read, is something else, or is larger.
    """
    try:
        with open(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "rb") as f:
            mode = os.fstat(f.fileno()).st_mode
            if not stat.S_ISREG(mode):
                raise DisasmError(f"{path}: is no regular file; {remedy}")
            data = f.read(most + 1)
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or str(error)
        raise DisasmError(f"{path}: can't be read ({why}); {remedy}") from None
    if len(data) > most:
        raise DisasmError(f"{path}: has more than {most / 2**20:g} MiB; {remedy}")
    return data


def read_text(path: Path, remedy: str, most: int) -> str:
    """Returns the content of a text file in UTF-8; see `read_bytes`."""
    try:
        return read_bytes(path, remedy, most).decode()
    except UnicodeDecodeError:
        raise DisasmError(f"{path}: is not text in UTF-8; {remedy}") from None


def read_json(path: Path, remedy: str, example: dict[str, Any]) -> dict[str, Any]:
    """Returns the mapping that a JSON file holds.

    Args:
        path: of the file.
        remedy: for messages.
        example: what must be in it, as in `plain_data.check_like`.

    Raises:
        DisasmError: as `read_bytes`, or it is damaged.
    """
    text = read_text(path, remedy, _MOST_JSON)
    try:
        content = json.loads(text)
        check_like(content, example)
    except (DisasmError, ValueError, RecursionError) as error:
        why = clipped(str(error))
        raise DisasmError(f"{path}: is damaged ({why}); {remedy}") from None
    return content


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
    except FileNotFoundError:
        raise DisasmError(
            f"{path}: cannot be written; make the folder {path.parent} first"
        ) from None
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


def write_figure(path: Path, figure: "Figure", dpi: float = 120.0) -> None:
    """Writes a Matplotlib figure as PNG; see `write_atomically`."""
    write_atomically(path, lambda s: figure.savefig(s, format="png", dpi=dpi))


@contextlib.contextmanager
def _uninterrupted() -> Iterator[None]:
    """Puts Ctrl-C and SIGTERM off to the end: libraries make other errors of them."""
    if threading.current_thread() is not threading.main_thread():
        yield  # there they do not come
        return
    handlers = {s: signal.getsignal(s) for s in (signal.SIGINT, signal.SIGTERM)}
    raising = {number: h for number, h in handlers.items() if callable(h)}
    came: list[tuple[int, FrameType | None]] = []
    for stop in raising:
        signal.signal(stop, lambda *caught: came.append(caught))
    try:
        yield
    finally:
        for stop, handler in raising.items():
            signal.signal(stop, handler)
    for number, frame in came[:1]:
        raising[signal.Signals(number)](number, frame)


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
