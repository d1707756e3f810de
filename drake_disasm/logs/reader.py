"""Reading logs: everything is checked, and refused by name, before use."""

import dataclasses
import hashlib
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from drake_disasm.common.files import read_bytes
from drake_disasm.logs.checks import check_values
from drake_disasm.logs.columns import arrange_names
from drake_disasm.logs.files import episode_files, unfinished_files
from drake_disasm.logs.header import LogHeader, read_header
from drake_disasm.logs.refusal import refusal
from drake_disasm.logs.schema import KINDS
from drake_disasm.logs.tables import MOST_BYTES, column_names, read_table
from drake_disasm.logs.unfinished import is_being_written


@dataclass(frozen=True)
class Episode:
    """One table of a log.

    Attributes:
        name: the file's name without suffix, such as "episode_0007".
        path: the file.
        columns: the columns, read-only, in the order that the schema declares;
            float64 or bool, all of the same length.
    """

    name: str
    path: Path
    columns: Mapping[str, NDArray[Any]]

    @property
    def rows(self) -> int:
        """The number of rows; an episode of transitions has one step fewer."""
        return len(next(iter(self.columns.values())))

    def select(self, rows: NDArray[np.int64]) -> Self:
        """The same episode with some of its rows, by their numbers."""
        columns = {name: values[rows] for name, values in self.columns.items()}
        return dataclasses.replace(self, columns=MappingProxyType(columns))

    def components(self, quantity: str) -> tuple[str, ...]:
        """The columns of a quantity, in declared order; empty if it has none."""
        prefix = f"{quantity}."
        return tuple(name for name in self.columns if name.startswith(prefix))

    def __contains__(self, quantity: str) -> bool:
        """Whether the episode has this quantity or column."""
        return quantity in self.columns or bool(self.components(quantity))

    def __getitem__(self, quantity: str) -> NDArray[Any]:
        """A column as `(rows,)`, or a quantity of several as `(rows, components)`.

        Raises:
            DisasmError: the episode has no such quantity.
        """
        if quantity in self.columns:
            return self.columns[quantity]
        names = self.components(quantity)
        if not names:
            raise refusal(
                self.path,
                f"no column '{quantity}' or '{quantity}.*'",
                "measure it, or ask for something that the log has",
            )
        return np.column_stack([self.columns[name] for name in names])


@dataclass(frozen=True)
class Log:
    """A log, read and checked whole.

    Attributes:
        folder: where it is.
        header: what `log.yaml` says.
        episodes: its episodes in the order of their numbers, at least one.
        data_hash: what `sha256sum episode_* | sha256sum` prints in the folder.
        remarks: what its reader should be told: episodes that are left out.
    """

    folder: Path
    header: LogHeader
    episodes: tuple[Episode, ...]
    data_hash: str
    remarks: tuple[str, ...] = ()


def read_log(folder: str | Path, numbers: Collection[int] | None = None) -> Log:
    """Reads the log in a folder; `docs/reference/log-format.md` describes the format.

    Temporary files that a killed writer left behind are ignored. An episode that is
    being recorded, or that a kill cut off, is left out with a remark.

    Args:
        folder: of the log.
        numbers: of the episodes to read, all if left out; the hash is of these alone.

    Raises:
        DisasmError: the folder is not a log, or something in it breaks the format;
            one line that names the file, the column or key, and the remedy.
    """
    folder = Path(folder)
    header = read_header(folder)
    paths = tuple(
        path
        for number, path in episode_files(folder).items()
        if numbers is None or number in numbers
    )
    remarks = tuple(_unfinished(folder))
    if not paths:
        raise refusal(
            folder,
            "no episode_0000.parquet or .csv",
            remarks[0] if remarks else "record at least one episode",
        )
    hashes: dict[str, str] = {}
    episodes = tuple(_read_episode(header, path, hashes) for path in paths)
    _check_same_columns(episodes)
    return Log(folder, header, episodes, _hash_of_hashes(hashes), remarks)


def read_logs(folders: Iterable[str | Path]) -> tuple[Log, ...]:
    """Reads several logs of one kind.

    Raises:
        DisasmError: as `read_log`, or the logs are of different kinds, or none.
    """
    logs = tuple(read_log(folder) for folder in folders)
    if not logs:
        raise refusal("logs", "no folder was named", "name at least one")
    for log in logs:
        if log.header.kind != logs[0].header.kind:
            raise refusal(
                log.folder / "log.yaml",
                f"mixed kinds: key 'kind' is '{log.header.kind}', that of "
                f"'{logs[0].folder}' is '{logs[0].header.kind}'",
                "read logs of different kinds apart",
            )
    return logs


def _unfinished(folder: Path) -> Iterator[str]:
    for number, path in unfinished_files(folder).items():
        what = "was cut off by a kill; recording with `resume` keeps its rows"
        if is_being_written(path):
            what = "is being recorded"
        yield f"{folder}: episode {number} is left out: it {what}"


def _read_episode(header: LogHeader, path: Path, hashes: dict[str, str]) -> Episode:
    data = read_bytes(path, "split it", MOST_BYTES)
    hashes[path.name] = hashlib.sha256(data).hexdigest()
    names = arrange_names(header, column_names(data, path), str(path))
    table = read_table(data, path, KINDS[header.kind].boolean_columns)
    ordered = {name: table[name] for name in names}
    columns = check_values(header, ordered, str(path))
    for values in columns.values():
        values.setflags(write=False)
    return Episode(path.stem, path, MappingProxyType(columns))


def _check_same_columns(episodes: tuple[Episode, ...]) -> None:
    first = episodes[0]
    for episode in episodes:
        check_same_names(first.columns, episode.columns, episode.path)


def check_same_names(
    expected: Iterable[str], names: Iterable[str], where: Path
) -> None:
    """Refuses a table whose columns differ from those of the log's first episode."""
    odd = sorted(set(expected) ^ set(names))
    if odd:
        raise refusal(
            where,
            f"column '{odd[0]}' is not in all episodes",
            "give all episodes of a log the same columns",
        )


def _hash_of_hashes(hashes: Mapping[str, str]) -> str:
    lines = "".join(f"{hashes[name]}  {name}\n" for name in sorted(hashes))
    return hashlib.sha256(lines.encode()).hexdigest()
