"""Writing logs: an episode is there whole or not at all."""

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

from numpy.typing import ArrayLike, NDArray

from drake_disasm.common.files import make_folder, write_atomically
from drake_disasm.logs.checks import check_values
from drake_disasm.logs.columns import arrange_names
from drake_disasm.logs.files import (
    episode_files,
    episode_path,
    is_empty,
    read_bytes,
)
from drake_disasm.logs.header import LogHeader, as_read, read_header, write_header
from drake_disasm.logs.reader import check_same_names
from drake_disasm.logs.refusal import quoted, refusal
from drake_disasm.logs.tables import FILE_FORMATS, column_names, write_table


class LogWriter:
    """Writes a log, one episode at a time; a killed run loses the running one only.

    It holds nothing open, so that it works with and without `with`.
    """

    def __init__(
        self,
        folder: str | Path,
        header: LogHeader,
        file_format: str = "parquet",
        resume: bool = False,
    ) -> None:
        """Makes the folder and writes its `log.yaml`.

        Args:
            folder: made if it is not there.
            header: what `log.yaml` will say.
            file_format: "parquet" or "csv".
            resume: continue the log in the folder, if there is one, after its last
                episode. Its header must be the same, but for the provenance, of
                which the first is kept.

        Raises:
            DisasmError: the folder is not empty and `resume` is false, or it holds
                something else than a log with this header; or the header breaks
                the format.
        """
        if file_format not in FILE_FORMATS:
            raise refusal(
                folder, f"file format '{file_format}'", f"use {quoted(FILE_FORMATS)}"
            )
        self._folder = Path(folder)
        self._format = file_format
        self._header = as_read(header, self._folder)
        self._names: list[str] | None = None
        self._next = 0
        make_folder(self._folder)
        self._start(resume)

    @property
    def folder(self) -> Path:
        """The folder of the log."""
        return self._folder

    @property
    def header(self) -> LogHeader:
        """The header, as it stands in `log.yaml`."""
        return self._header

    @property
    def next_number(self) -> int:
        """The number that the next episode will have."""
        return self._next

    def write_episode(self, columns: Mapping[str, ArrayLike]) -> Path:
        """Checks an episode as the reader does and writes it.

        Args:
            columns: column name to values, one per row; see `flat_columns`.

        Returns:
            The file, which is on the disk by then.

        Raises:
            DisasmError: the columns break the format, or can't be written. Nothing
                is written then.
        """
        path = episode_path(self._folder, self._next, self._format)
        names = arrange_names(self._header, list(columns), str(path))
        check_same_names(self._names or names, names, path)
        ordered = {name: columns[name] for name in names}
        table = check_values(self._header, ordered, str(path))
        self._write(path, table)
        self._names = list(names)
        self._next += 1
        return path

    def __enter__(self) -> Self:
        """Returns the writer."""
        return self

    def __exit__(self, *_: object) -> None:
        """Does nothing: every episode is complete once it is written."""

    def _start(self, resume: bool) -> None:
        if is_empty(self._folder):
            write_header(self._folder, self._header)
        elif resume:
            self._continue()
        else:
            raise refusal(
                self._folder,
                "an output folder that is not empty",
                "name a new one, empty it, or resume the log in it",
            )

    def _continue(self) -> None:
        found = read_header(self._folder)
        for field in dataclasses.fields(LogHeader):
            old, new = (getattr(h, field.name) for h in (found, self._header))
            if field.name != "provenance" and old != new:
                raise refusal(
                    self._folder / "log.yaml",
                    f"key '{field.name}' is {old!r}, the log to resume has {new!r}",
                    "resume with the same header, or name a new folder",
                )
        self._header = found
        paths = episode_files(self._folder)
        if paths:
            self._next = max(paths) + 1
            self._names = _names_in(next(iter(paths.values())))

    def _write(self, path: Path, table: Mapping[str, NDArray[Any]]) -> None:
        if path.exists():
            raise refusal(
                path, "written by another program meanwhile", "name a folder for each"
            )
        write_atomically(path, lambda stream: write_table(table, self._format, stream))


def _names_in(path: Path) -> list[str]:
    return column_names(read_bytes(path, "check its permissions"), path)
