"""Writing logs: an episode is there whole or not at all, or its rows as they come."""

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from drake_disasm.common.files import make_folder, read_bytes, write_atomically
from drake_disasm.common.text import shown
from drake_disasm.logs.checks import check_values
from drake_disasm.logs.columns import arrange_names
from drake_disasm.logs.files import (
    episode_files,
    episode_path,
    is_empty,
    unfinished_files,
    unfinished_path,
)
from drake_disasm.logs.header import LogHeader, as_read, read_header, write_header
from drake_disasm.logs.open_episode import OpenEpisode
from drake_disasm.logs.reader import check_same_names
from drake_disasm.logs.refusal import quoted, refusal
from drake_disasm.logs.schema import KINDS
from drake_disasm.logs.tables import FILE_FORMATS, MOST_BYTES, column_names, write_table
from drake_disasm.logs.unfinished import RowFile, is_being_written, read_rows

_KILLED = "the program was killed"


class LogWriter:
    """Writes a log, one episode at a time.

    A killed run loses the running episode if that is written at its end
    (`write_episode`), and none of its rows if they are written as they come
    (`begin_episode`). It holds nothing open, so that it works with and without `with`.
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
                episode, and close an episode that a kill cut off (`remarks` says
                so). Its header must be the same, but for the provenance, of which
                the first is kept, and the notes.

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
        self._newest: int | None = None
        self.remarks: list[str] = []
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
        names = self._arranged(list(columns), path)
        ordered = {name: columns[name] for name in names}
        table = check_values(self._header, ordered, str(path))
        self._write(path, table)
        self._names, self._newest = names, self._next
        self._next += 1
        return path

    def begin_episode(self) -> OpenEpisode:
        """Begins the next episode, row by row; `write_episode` waits until it ends.

        What is appended outlives the program: if it is killed, the next start with
        `resume` closes the episode.
        """
        path = unfinished_path(self._folder, self._next)
        self._newest = None

        def begin(names: list[str]) -> RowFile:
            """Begins the file at the first row, whose columns are known then."""
            file = RowFile(path, self._arranged(names, path))
            self._newest = self._next
            return file

        return OpenEpisode(
            self._header.kind, begin, lambda cut_off: self._keep(path, cut_off)
        )

    def note(self, **values: Any) -> None:
        """Adds to what the header says of the episode begun or written last.

        It rewrites `log.yaml`, so call it when no robot waits. If no episode has come
        of what was begun last, there is nothing to note.

        Args:
            values: plain data by key; `cut_off` is the format's own.

        Raises:
            DisasmError: not plain data, or it can't be written.
        """
        if self._newest is None:
            return
        notes = {number: dict(note) for number, note in self._header.notes.items()}
        notes[self._newest] = notes.get(self._newest, {}) | values
        header = dataclasses.replace(self._header, notes=dict(sorted(notes.items())))
        self._header = as_read(header, self._folder)
        write_header(self._folder, self._header)

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
            if field.name not in ("provenance", "notes") and old != new:
                raise refusal(
                    self._folder / "log.yaml",
                    f"key '{field.name}' is {shown(old)}, the log to resume has "
                    f"{shown(new)}",
                    "resume with the same header, or name a new folder",
                )
        self._header = found
        paths = episode_files(self._folder)
        if paths:
            self._names = list(_names_in(next(iter(paths.values()))))
        for number, path in unfinished_files(self._folder).items():
            self._recover(number, path, number in paths)
        self._next = max(episode_files(self._folder), default=-1) + 1
        self._newest = None

    def _recover(self, number: int, path: Path, is_written: bool) -> None:
        """Closes an episode whose program was killed."""
        if is_being_written(path):
            raise refusal(
                path, "is written by another program", "wait for it, or stop it"
            )
        if is_written:  # it was killed when only this was left to do
            path.unlink()
            return
        self._next = self._newest = number  # for the note
        kept = self._keep(path, _KILLED)
        what = f"was cut off: {_KILLED}; its rows are kept as {kept and kept.name}"
        if kept is None:
            what = (
                f"was cut off before its first step: {_KILLED}; nothing of it is kept"
            )
        self.remarks.append(f"{self._folder}: episode {number} {what}")

    def _arranged(self, names: list[str], path: Path) -> list[str]:
        """Returns the names in the declared order; refuses those of another log."""
        arranged = arrange_names(self._header, names, str(path))
        check_same_names(self._names or arranged, arranged, path)
        return list(arranged)

    def _keep(self, path: Path, cut_off: str | None) -> Path | None:
        """Turns a file of rows into an episode; each order of its steps can be killed.

        The note comes first, and the rows go last: a next start finds either and
        does the rest.
        """
        kind = KINDS[self._header.kind]
        table = read_rows(path, kind)
        rows = len(next(iter(table.values()), ()))
        if rows < kind.min_rows:
            path.unlink()
            self._newest = None
            return None
        flags = [table[name] for name in kind.boolean_columns if name in table]
        if cut_off and not any(flag[-1] for flag in flags):
            if "truncated" in table:
                table["truncated"] = np.append(table["truncated"][:-1], True)
            if "cut_off" not in self._header.notes.get(self._next, {}):
                self.note(cut_off=cut_off)
        episode = self.write_episode(table)
        path.unlink()
        return episode

    def _write(self, path: Path, table: Mapping[str, NDArray[Any]]) -> None:
        if path.exists():
            raise refusal(
                path, "written by another program meanwhile", "name a folder for each"
            )
        write_atomically(path, lambda stream: write_table(table, self._format, stream))


def _names_in(path: Path) -> list[str]:
    return column_names(read_bytes(path, "split it", MOST_BYTES), path)
