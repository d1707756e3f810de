"""The output folder of a watch: lines, state and page; it goes on where it was."""

import json
import os
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from drake_disasm.common.archive import ArchiveKind, load_archive, save_archive
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import make_folder, write_text
from drake_disasm.common.finished_work import refuse_difference
from drake_disasm.scenario import dump_scenario
from sysid.monitoring.judgement import Judgement
from sysid.monitoring.monitor import Monitor
from sysid.monitoring.page import monitor_page
from sysid.monitoring.reference import Reference
from sysid.monitoring.watched import WatchedFolder

LINES, STATE, PAGE, NOMINAL = (
    *("episodes.jsonl", "state.npz", "report.html", "nominal.yaml"),
)
_PAGE_PERIOD = 5.0  # s between two pages at least: drawing one takes half a second
_STATE = ArchiveKind(
    "state of a watch",
    "name a new --out folder",
    "name a new --out folder to begin again",
    most_bytes=2**30,
    most_members=20,
)


@dataclass
class Record:
    """What a watch writes.

    Attributes:
        folder: of its output.
        monitor: what it has come to.
        watched: where episodes come from.
        origin: provenance.
        identity: what the state depends on.
    """

    folder: Path
    monitor: Monitor
    watched: WatchedFolder
    origin: Mapping[str, Any]
    identity: Mapping[str, Any]
    _next_page: float = field(default=0.0)

    @classmethod
    def open(
        cls,
        folder: Path,
        reference: Reference,
        watched: Path,
        every: float,
        origin: Mapping[str, Any],
        waits: bool = False,
    ) -> "Record":
        """Returns the record in a folder as it was, or a new one.

        Args:
            folder: of the output.
            reference: to judge by.
            watched: folder of the episodes.
            every: mean number of episodes between false alarms.
            origin: provenance.
            waits: whether more episodes may come.

        Raises:
            DisasmError: the folder is of another reference or watched folder; or the
                reference's logs are gone or changed.
        """
        identity = {"reference": reference.to_mapping(), "log": str(watched)}
        identity = json.loads(json.dumps(identity))
        nominal = folder / NOMINAL if reference.choice.scenario else None
        source = WatchedFolder(watched, waits)
        if (folder / STATE).exists():
            arrays, plain = load_archive(folder / STATE, _STATE)
            refuse_difference(folder, plain["identity"], identity)
            monitor = Monitor.from_archive(reference, arrays, plain, every, nominal)
            source.last = _taken(folder / LINES, plain["offset"], watched)
            return cls(folder, monitor, source, origin, identity)
        monitor = Monitor.of(reference, every, nominal)
        make_folder(folder)
        if nominal is not None and reference.choice.scenario is not None:
            write_text(nominal, dump_scenario(reference.choice.scenario))
        (folder / LINES).write_text("")
        found = cls(folder, monitor, source, origin, identity)
        found._keep_state()
        return found

    def keep(self, judgement: Judgement) -> str:
        """Writes a judgement and the state after it; returns the judgement's line."""
        line = json.dumps(judgement.to_mapping())
        with (self.folder / LINES).open("a") as stream:
            stream.write(f"{line}\n")
        self._keep_state()
        if judgement.is_alarm or time.monotonic() >= self._next_page:
            self.draw()
        return line

    def draw(self) -> None:
        """Writes the page."""
        page = monitor_page(self.monitor, self.watched.folder, self.origin)
        write_text(self.folder / PAGE, page)
        self._next_page = time.monotonic() + _PAGE_PERIOD

    def _keep_state(self) -> None:
        arrays, plain = self.monitor.to_archive()
        offset = (self.folder / LINES).stat().st_size
        state = plain | {"identity": self.identity, "offset": offset}
        save_archive(self.folder / STATE, arrays, state)


def _taken(path: Path, offset: int, watched: Path) -> dict[str, int]:
    """Returns the last episode taken of each log, and removes lines without a state.

    Args:
        path: of the lines.
        offset: bytes of them that the state knows.
        watched: folder of the episodes.

    Raises:
        DisasmError: the lines are gone or damaged.
    """
    found: dict[str, int] = {}
    try:
        with path.open("r+b") as stream:
            os.truncate(stream.fileno(), offset)
            for line in stream:
                plain = json.loads(line)
                folder = Path(plain["log"])
                name = "" if folder == watched else folder.name
                found[name] = plain["episode"]
    except (OSError, ValueError, LookupError, TypeError) as error:
        raise DisasmError(
            f"{path}: is gone or damaged ({error}); name a new --out folder"
        ) from None
    return found
