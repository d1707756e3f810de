"""A folder to which episodes are added: those that are new, once they are whole."""

import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from drake_disasm.common.errors import DisasmError
from drake_disasm.logs import Log, read_log
from drake_disasm.logs.files import episode_files
from drake_disasm.logs.header import HEADER_NAME

#: Of a file that is being copied, the size rests for less than this [s].
QUIET = 2.0
#: What can't be read after so long is damaged, and not half-written [s].
PATIENCE = 30.0


@dataclass(frozen=True)
class Arrival:
    """An episode that has come.

    Attributes:
        folder: of its log.
        number: in the log.
        log: with this episode alone; None if it can't be read.
        error: why; empty if it can.
    """

    folder: Path
    number: int
    log: Log | None
    error: str = ""


@dataclass
class WatchedFolder:
    """A log that grows, or a folder to which logs are added; these in name order.

    Attributes:
        folder: that is watched.
        waits: whether more may come: files that are still being written have time.
        last: number of the last episode that was taken, by the name of its log, "" for
            the folder itself.
    """

    folder: Path
    waits: bool = False
    last: dict[str, int] = field(default_factory=dict)
    _unread: dict[Path, float] = field(default_factory=dict)  # since when

    def arrivals(self) -> Iterator[Arrival]:
        """Yields the episodes that have come since, each once.

        Raises:
            DisasmError: the folder is gone.
        """
        if not self.folder.is_dir():
            raise DisasmError(
                f"{self.folder}: is no folder, or is gone; name one to which logs are "
                "added, or bring it back: the same command goes on"
            )
        if (self.folder / HEADER_NAME).exists():
            yield from self._of_log("", self.folder)
            return
        for path in sorted(p for p in self.folder.iterdir() if p.is_dir()):
            yield from self._of_log(path.name, path)

    def take(self, arrival: Arrival) -> None:
        """Notes that an episode was taken, so that it does not come again."""
        is_own = arrival.folder == self.folder
        self.last["" if is_own else arrival.folder.name] = arrival.number

    def _of_log(self, name: str, folder: Path) -> Iterator[Arrival]:
        """Yields a log's new episodes, up to the first that is not whole yet."""
        if not (folder / HEADER_NAME).exists():
            return
        try:
            paths = episode_files(folder)
        except DisasmError as error:
            if name not in self.last and self._is_late(folder):
                yield Arrival(folder, 0, None, str(error))
            return
        for number, path in paths.items():
            if number <= self.last.get(name, -1):
                continue
            arrival = self._arrival(folder, number, path)
            if arrival is None:
                return
            self._unread.pop(path, None)
            yield arrival

    def _arrival(self, folder: Path, number: int, path: Path) -> Arrival | None:
        """Returns an episode; None of one that may be half-written."""
        try:
            if self.waits and 0.0 <= time.time() - path.stat().st_mtime < QUIET:
                return None
            return Arrival(folder, number, read_log(folder, [number]))
        except (DisasmError, OSError) as error:
            if self._is_late(path):
                return Arrival(folder, number, None, str(error))
            return None

    def _is_late(self, path: Path) -> bool:
        """Returns whether what can't be read has had time to be written whole."""
        since = self._unread.setdefault(path, time.monotonic())
        return not self.waits or time.monotonic() - since > PATIENCE
