"""A cache of fits on disk, so that a search that was stopped can resume.

A search is deterministic: started again with the same log, scenario and library it
asks for the same fits, and cached ones cost nothing. The key of a fit is a hash of all
that it depends on.
"""

import hashlib
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from drake_disasm.common.files import make_folder, write_npz
from sysid.identification.linearisation import Linearisation

_ARRAYS = ("u", "residual", "jacobian", "weights", "huber_delta")


def cached_fit(
    folder: Path | None, depends_on: Any, find: Callable[[], Linearisation]
) -> Linearisation:
    """Returns a fit from the cache, or computes and caches it.

    Args:
        folder: of the cache; None for no cache.
        depends_on: everything that the fit depends on.
        find: computes the fit.
    """
    if folder is None:
        return find()
    name = hashlib.sha256(pickle.dumps(depends_on)).hexdigest()
    path = folder / f"{name[:32]}.npz"
    if path.exists():
        with np.load(path) as data:
            arrays = {key: data[key] for key in _ARRAYS[:-1]}
            return Linearisation(**arrays, huber_delta=float(data["huber_delta"]))
    found = find()
    make_folder(folder)
    arrays = {key: getattr(found, key) for key in _ARRAYS}
    write_npz(path, **arrays)
    return found
