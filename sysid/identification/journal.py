"""Finished evaluations and stages of an identification, on disk."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_disasm.common.finished_work import FinishedWork
from sysid.optimise.coordinates import BatchFunction

Array = NDArray[np.float64]


class Journal:
    """Values of every point that a search evaluated, and results of whole stages.

    It serves any search, NLopt's too, which can't be interrupted and continued from
    outside: started again, it asks for the same points; see `FinishedWork`.
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
        self._work = FinishedWork(folder, identity, resume, "an identification")

    def stage(self, name: str) -> Any:
        """Returns the result of a finished stage, or None."""
        return self._work.get([name])

    def finish(self, name: str, result: Any) -> None:
        """Keeps the result of a stage: plain data."""
        self._work.keep([name], result)

    def remembered(self, name: str, function: BatchFunction) -> BatchFunction:
        """Returns a function whose values are looked up, or evaluated and kept."""

        def value(points: Array) -> Array:
            """Evaluates what is not known yet."""
            keys = [[name, point.tolist()] for point in points]
            new = [i for i, key in enumerate(keys) if self._work.get(key) is None]
            if new:
                found = function(points[new]).tolist()
                self._work.keep_all(
                    (keys[i], value) for i, value in zip(new, found, strict=True)
                )
            return np.array([self._work.get(key) for key in keys])

        return value
