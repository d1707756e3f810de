"""What was evaluated already, on disk: the one mechanism behind resuming."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import make_folder, write_atomically
from sysid.optimise.coordinates import BatchFunction

Array = NDArray[np.float64]


class Journal:
    """Values of every point that a search evaluated, and results of whole stages.

    Searches are deterministic, so a search that is begun again asks for the same
    points; those that the journal knows cost nothing, and from there it goes on,
    bit for bit. That serves any search, NLopt's too, which can't be interrupted
    and taken up again from outside.
    """

    def __init__(self, folder: Path, identity: Mapping[str, Any], resume: bool) -> None:
        """Opens the journal of a folder.

        Args:
            folder: made if it is not there.
            identity: what must be the same for values to be valid: plain data.
            resume: whether to go on with what is there.

        Raises:
            DisasmError: the folder holds another identification, or one and
                `resume` is false.
        """
        make_folder(folder)
        self._path = folder / "evaluations.jsonl"
        self._stages_path = folder / "stages.json"
        self._identity = json.loads(json.dumps(identity))
        self._values: dict[tuple[str, bytes], float] = {}
        self._stages: dict[str, Any] = {}
        self._open(folder, resume)

    def stage(self, name: str) -> Any:
        """Returns what a finished stage left, or None."""
        return self._stages.get(name)

    def finish(self, name: str, result: Any) -> None:
        """Keeps the result of a stage: plain data."""
        self._stages[name] = result
        self._write_stages()

    def remembered(self, name: str, function: BatchFunction) -> BatchFunction:
        """Returns a function whose values are looked up, or evaluated and kept."""

        def value(points: Array) -> Array:
            """Evaluates what is not known yet."""
            keys = [(name, point.tobytes()) for point in points]
            new = [i for i, key in enumerate(keys) if key not in self._values]
            if new:
                found = function(points[new])
                self._keep(name, points[new], found)
            return np.array([self._values[key] for key in keys])

        return value

    def _keep(self, name: str, points: Array, values: Array) -> None:
        lines = ""
        for point, value in zip(points, values, strict=True):
            self._values[name, point.tobytes()] = float(value)
            entry = {"stage": name, "u": point.tolist(), "f": float(value)}
            lines += json.dumps(entry) + "\n"
        with self._path.open("a") as stream:
            stream.write(lines)

    def _open(self, folder: Path, resume: bool) -> None:
        if not self._stages_path.exists():
            if any(folder.iterdir()):
                raise DisasmError(
                    f"{folder}: an output folder that is not empty and holds no "
                    "identification; name a new one"
                )
            self._write_stages()
            return
        if not resume:
            raise DisasmError(
                f"{folder}: holds an identification already; go on with it by --resume "
                "or name a new folder"
            )
        kept = json.loads(self._stages_path.read_text())
        self._refuse_another(folder, kept["identity"])
        self._stages = kept["stages"]
        self._read_values()

    def _refuse_another(self, folder: Path, identity: Mapping[str, Any]) -> None:
        for key, value in self._identity.items():
            if identity.get(key) != value:
                raise DisasmError(
                    f"{folder}: was begun with another {key}; resume with the same "
                    "arguments or name a new folder"
                )

    def _read_values(self) -> None:
        """Reads what is whole: a killed run may have left half a line."""
        if not self._path.exists():
            return
        whole = ""
        for line in self._path.read_text().splitlines():
            try:
                entry = json.loads(line)
            except json.JSONDecodeError:
                break
            whole += line + "\n"
            key = entry["stage"], np.array(entry["u"]).tobytes()
            self._values[key] = entry["f"]
        write_atomically(self._path, lambda stream: stream.write(whole.encode()))

    def _write_stages(self) -> None:
        text = json.dumps({"identity": self._identity, "stages": self._stages})
        write_atomically(self._stages_path, lambda stream: stream.write(text.encode()))
