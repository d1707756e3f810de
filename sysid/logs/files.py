"""The files of a log: names of episodes, and writing whole or not at all."""

import contextlib
import os
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO, Any

from sysid.logs.refusal import refusal

_EPISODE = re.compile(r"episode_(\d{4,})\.(parquet|csv)")
_TEMPORARY = re.compile(r"\..*\.tmp")


def episode_path(folder: Path, number: int, file_format: str) -> Path:
    """The file of an episode, such as `folder/episode_0007.parquet`."""
    return folder / f"episode_{number:04d}.{file_format}"


def episode_files(folder: Path) -> dict[int, Path]:
    """The episodes of a log by number, in order; gaps are allowed.

    Raises:
        DisasmError: a file's name starts as an episode's and is none, or two files
            have the same number.
    """
    found: dict[int, Path] = {}
    for path in sorted(folder.glob("episode_*")):
        number = _episode_number(path)
        if number in found:
            raise refusal(
                path, f"same episode as '{found[number].name}'", "remove one of them"
            )
        found[number] = path
    return dict(sorted(found.items()))


def _episode_number(path: Path) -> int:
    match = _EPISODE.fullmatch(path.name)
    if not match:
        raise refusal(
            path,
            "not an episode's file name",
            "rename it to the pattern episode_0000.csv or episode_0000.parquet",
        )
    return int(match[1])


def is_empty(folder: Path) -> bool:
    """Whether a folder holds nothing but what a killed writer may leave behind."""
    return all(_TEMPORARY.fullmatch(path.name) for path in folder.iterdir())


def make_folder(folder: Path) -> None:
    """Makes a folder and its parents, if they are not there."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise refusal(
            folder, f"no such folder can be made ({error.strerror})", "name another"
        ) from error


def read_bytes(path: Path, remedy: str) -> bytes:
    """The content of a file, or a refusal with this remedy."""
    try:
        return path.read_bytes()
    except OSError as error:
        raise refusal(path, f"cannot be read ({error.strerror})", remedy) from error


def write_atomically(path: Path, write: Callable[[IO[bytes]], Any]) -> None:
    """Writes a file whole or not at all.

    The content goes to a hidden temporary file in the same folder, reaches the disk,
    and takes the file's name in one step.

    Args:
        path: the file.
        write: writes the content to the stream that it is given.

    Raises:
        DisasmError: the system refuses to write.
    """
    temporary = path.with_name(f".{path.name}.tmp")
    try:
        with _removed_on_failure(temporary):
            with temporary.open("wb") as stream:
                write(stream)
                stream.flush()
                os.fsync(stream.fileno())
            os.replace(temporary, path)
        _sync_folder(path.parent)
    except OSError as error:
        raise refusal(
            path,
            f"cannot be written ({error.strerror})",
            "check the disk's space and the folder's permissions",
        ) from error


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
