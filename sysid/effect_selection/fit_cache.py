"""Fits that are kept on disk, so that a search that was stopped can go on.

A search is deterministic: begun again with the same log, scenario and library it asks
for the same fits, and those that are kept cost nothing. Each is found by all that it
depends on, so nothing can be taken for something else.
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


def remembered(
    folder: Path | None, depends_on: Any, find: Callable[[], Linearisation]
) -> Linearisation:
    """Returns what is kept in a folder, else what is found, which is then kept.

    Args:
        folder: of the fits; None keeps none.
        depends_on: everything that the fit depends on.
        find: fits.
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
