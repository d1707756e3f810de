"""A cache on disk, so that a search that was stopped can resume.

A search is deterministic: started again with the same log, scenario and library it
asks for the same fits and derivatives, and cached ones cost nothing. The key is a hash
of all that they depend on.
"""

import hashlib
import math
import pickle
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_disasm.common.finished_work import Arrays, FinishedWork
from sysid.identification.linearisation import Linearisation

_ARRAYS = ("u", "residual", "jacobian", "weights")


class _UnfinishedError(Exception):
    """A fit that ended because its time was over."""

    def __init__(self, fit: Linearisation) -> None:
        super().__init__()
        self.fit = fit


def cached_fit(
    folder: Path | None,
    depends_on: Any,
    find: Callable[[], Linearisation],
    deadline: float = math.inf,
) -> Linearisation:
    """Returns a fit from the cache, or computes and caches it.

    Args:
        folder: of the cache; None for no cache.
        depends_on: everything that the fit depends on.
        find: computes the fit.
        deadline: by `time.monotonic` [s]: what is found later may not have come to an
            end, and is not cached.
    """
    if folder is None:
        return find()

    def _whole() -> Arrays:
        found = find()
        if time.monotonic() > deadline:
            raise _UnfinishedError(found)
        return _arrays(found)

    try:
        kept = FinishedWork(folder).arrays(_key(depends_on), _whole)
    except _UnfinishedError as unfinished:
        return unfinished.fit
    arrays = {name: kept[name] for name in _ARRAYS}
    return Linearisation(**arrays, huber_delta=float(kept["huber_delta"]))


def cached_array(
    folder: Path, depends_on: Any, find: Callable[[], NDArray[np.float64]]
) -> NDArray[np.float64]:
    """Returns an array from the cache, or computes and caches it.

    Args:
        folder: of the cache.
        depends_on: everything that the array depends on.
        find: computes it.
    """
    work = FinishedWork(folder)
    return work.arrays(_key(depends_on), lambda: {"array": find()})["array"]


def _key(depends_on: Any) -> str:
    return hashlib.sha256(pickle.dumps(depends_on)).hexdigest()


def _arrays(fit: Linearisation) -> Arrays:
    return {name: getattr(fit, name) for name in (*_ARRAYS, "huber_delta")}
