"""A reader or codec that is fuzzed, and what subjects are made of."""

import dataclasses
import io
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]
import pyarrow.parquet as pq  # type: ignore[import-untyped]
from mutations import Random, damaged, damaged_archive, damaged_columns, damaged_yaml

from drake_disasm.common.archive import Arrays


@dataclasses.dataclass(frozen=True)
class Subject:
    """A reader or codec that is fuzzed.

    Attributes:
        make: returns something damaged to be read.
        read: reads it.
    """

    make: Callable[[Random], Any]
    read: Callable[[Any], object]


def file_subject(name: str, make: Callable[[Random], bytes], read: Any) -> Subject:
    """Returns the subject of a reader of one file, which is written and read.

    Args:
        name: of the file.
        make: returns damaged content.
        read: is given the file's path.
    """
    path = new_folder() / name

    def write_and_read(content: bytes) -> object:
        """Returns what is read."""
        path.write_bytes(content)
        return read(path)

    return Subject(make, write_and_read)


def folder_subject(folder: Path, read: Callable[[], object]) -> Subject:
    """Returns the subject of a reader of several files, one of which is damaged.

    Args:
        folder: with valid files.
        read: reads them there.
    """
    whole = {path.name: path.read_bytes() for path in folder.iterdir()}

    def make(rng: Random) -> tuple[str, bytes]:
        """Returns the name of one and its damaged content."""
        name = list(whole)[rng.integers(len(whole))]
        return name, damaged(whole[name], rng)

    def write_and_read(content: tuple[str, bytes]) -> object:
        """Returns what is read of it beside what is whole."""
        for name, data in (whole | dict([content])).items():
            (folder / name).write_bytes(data)
        return read()

    return Subject(make, write_and_read)


def yaml_subject(name: str, texts: list[str], read: Any) -> Subject:
    """Returns the subject of a reader of YAML.

    Args:
        name: of the file.
        texts: valid ones, one of which is damaged.
        read: is given the file's path.
    """

    def make(rng: Random) -> bytes:
        """Returns a damaged one."""
        text = texts[rng.integers(len(texts))]
        return either_way(text, damaged_yaml, rng)

    return file_subject(name, make, read)


def new_folder() -> Path:
    """Returns a new folder; whoever set `tempfile.tempdir` removes it."""
    return Path(tempfile.mkdtemp())


def either_way(text: str, edit: Callable[[str, Random], str], rng: Random) -> bytes:
    """Returns text damaged blindly, by design, or both."""
    text = edit(text, rng) if rng.integers(4) else text
    data = text.encode(errors="replace")
    return damaged(data, rng) if rng.integers(4) == 0 else data


def blindly_or(
    data: bytes, edit: Callable[[Random], bytes]
) -> Callable[[Random], bytes]:
    """Returns what damages a file blindly one time, and by design the other."""
    return lambda rng: damaged(data, rng) if rng.integers(2) else edit(rng)


def archive_damage(
    data: bytes, arrays: Arrays, text: dict[str, Any]
) -> Callable[[Random], bytes]:
    """Returns what damages an archive of arrays (and a text, as ours have)."""
    return blindly_or(data, lambda rng: damaged_archive(arrays, text, rng))


def parquet_damage(data: bytes, columns: Arrays) -> Callable[[Random], bytes]:
    """Returns what damages a Parquet file of columns (n,)."""
    rows = len(next(iter(columns.values())))

    def edit(rng: Random) -> bytes:
        """Returns a table whose types, names or values are wrong."""
        changed = damaged_columns(columns | {"rows": np.zeros(rows)}, rng)
        stream = io.BytesIO()
        try:
            pq.write_table(pa.table(changed), stream)
        except (pa.ArrowException, ValueError):  # what no Parquet file can be
            return damaged(data, rng)
        return stream.getvalue()

    return blindly_or(data, edit)
