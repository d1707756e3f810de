"""Finished work kept in a folder, so that a run that was stopped can be resumed.

Work that is deterministic asks for the same results when it is started again; those
that are kept cost nothing, and it goes on from there bit for bit.
"""

import hashlib
import json
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_disasm.common.archive import ArchiveKind, load_archive, save_archive
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import (
    make_folder,
    read_json,
    read_text,
    write_json,
    write_text,
)
from drake_disasm.common.text import clipped

Arrays = Mapping[str, NDArray[Any]]

_IDENTITY, _RESULTS = "identity.json", "results.jsonl"
_NEW = "name a new folder"
_REMEDY = "delete it to find its results again"
_MOST_BYTES = 2**31  # of a file
_ARRAYS = ArchiveKind(
    "result", _REMEDY, _REMEDY, _MOST_BYTES, most_members=1000, checksum=False
)


def is_resumed(folder: Path, marker: str, what: str, resume: bool) -> bool:
    """Makes an output folder; returns whether it holds work that is to be resumed.

    Args:
        folder: of the output.
        marker: name of the file that is there from the beginning.
        what: the folder holds, such as "a training".
        resume: whether the user wants to go on with what is there.

    Raises:
        DisasmError: it holds something else, or the work and `resume` is false.
    """
    make_folder(folder)
    if not (folder / marker).exists():
        if any(folder.iterdir()):
            raise DisasmError(
                f"{folder}: is not empty and does not hold {what}; name a new folder"
            )
        return False
    if not resume:
        raise DisasmError(
            f"{folder}: holds {what} already; set `resume`, or name a new folder"
        )
    return True


def refuse_difference(
    folder: Path, found: Mapping[str, Any], wanted: Mapping[str, Any]
) -> None:
    """Refuses to resume work whose results depend on something else.

    Args:
        folder: of the output.
        found: what its results depend on, as plain data.
        wanted: the same of the work that is to go on; more may have been found.

    Raises:
        DisasmError: they differ; names the first difference and both values.
    """
    for key in wanted:
        if found.get(key) != wanted[key]:
            raise DisasmError(
                f"{folder}: was begun with another {_difference(found, wanted, key)}; "
                "resume with the same, or name a new folder"
            )


def _difference(found: Mapping[str, Any], wanted: Mapping[str, Any], key: str) -> str:
    """Returns the path and both values of the first difference under a key."""
    old, new = found.get(key), wanted[key]
    if isinstance(old, dict) and isinstance(new, dict):
        inner = next(k for k in {**old, **new} if old.get(k) != new.get(k))
        return f"{key}.{_difference(old, {**new, inner: new.get(inner)}, inner)}"
    return f"{key} ({old}, not {new})"


class FinishedWork:
    """Results by keys that say all that each depends on.

    The folder holds `identity.json` (what all results depend on), `results.jsonl` (a
    line for each result of plain data) and an `.npz` for each result of arrays.
    """

    def __init__(
        self,
        folder: Path | None = None,
        identity: Mapping[str, Any] | None = None,
        resume: bool = True,
        what: str = "results",
    ) -> None:
        """Opens a folder.

        Args:
            folder: made if it is not there; None keeps results in memory alone.
            identity: what all results depend on, as plain data; None if their keys
                say it all.
            resume: whether to go on with results that are there.
            what: the folder holds, for messages: "an identification".

        Raises:
            DisasmError: the folder holds something else, results that depend on
                something else, damaged ones, or results and `resume` is false.
        """
        self._folder = folder
        self._results: dict[str, Any] = {}
        if folder is not None:
            if identity is not None:
                self._check_identity(folder, identity, resume, what)
            self._read(folder)

    def get(self, key: Any) -> Any:
        """Returns the result of a key (plain data), or None."""
        return self._results.get(json.dumps(key))

    def keep(self, key: Any, result: Any) -> None:
        """Keeps a result: plain data."""
        self.keep_all([(key, result)])

    def keep_all(self, results: Iterable[tuple[Any, Any]]) -> None:
        """Keeps pairs of key and result, in one go."""
        lines = []
        for key, result in results:
            self._results[json.dumps(key)] = result
            lines.append(json.dumps({"key": key, "result": result}) + "\n")
        if self._folder is not None:
            make_folder(self._folder)
            with (self._folder / _RESULTS).open("a") as stream:
                stream.write("".join(lines))

    def arrays(self, key: Any, find: Callable[[], Arrays]) -> Arrays:
        """Returns arrays by name that are kept, or finds them and keeps them.

        Args:
            key: plain data.
            find: returns the arrays.
        """
        if self._folder is None:
            return find()
        name = hashlib.sha256(json.dumps(key).encode()).hexdigest()
        path = self._folder / f"{name[:32]}.npz"
        if path.exists():
            return load_archive(path, _ARRAYS)[0]
        found = find()
        make_folder(self._folder)
        save_archive(path, {n: np.asarray(a) for n, a in found.items()}, {"key": key})
        return found

    def _check_identity(
        self, folder: Path, identity: Mapping[str, Any], resume: bool, what: str
    ) -> None:
        path = folder / _IDENTITY
        wanted = json.loads(json.dumps(identity))
        if is_resumed(folder, _IDENTITY, what, resume):
            refuse_difference(folder, read_json(path, _NEW, {}), wanted)
        else:
            write_json(path, wanted)

    def _read(self, folder: Path) -> None:
        """Reads what is whole: a killed run may have left half a last line."""
        path = folder / _RESULTS
        if not path.exists():
            return
        lines = read_text(path, _REMEDY, _MOST_BYTES).splitlines(keepends=True)
        for i, line in enumerate(lines):
            try:
                entry = json.loads(line)
                self._results[json.dumps(entry["key"])] = entry["result"]
            except (ValueError, LookupError, TypeError, RecursionError) as error:
                if i < len(lines) - 1 or line.endswith("\n"):
                    raise DisasmError(
                        f"{path}: line {i + 1} is damaged ({clipped(str(error))}); "
                        f"{_REMEDY}"
                    ) from None
                write_text(path, "".join(lines[:i]))
