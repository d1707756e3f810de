"""MATLAB files, read by SciPy in a process of its own.

SciPy's reader may crash of a damaged file, a fault in compiled code (its issue 6072),
which would take the program with it. This module is that process's program, too; it
imports nothing of ours, so that it starts in half a second.
"""

import io
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

Arrays = dict[str, np.ndarray]


class MatlabError(Exception):
    """A MATLAB file that can't be read; says why, in one line."""


def load_mat(path: Path) -> Arrays:
    """Returns the arrays in a MATLAB file, a struct's as "struct.name".

    Args:
        path: of a file of version 7 or older.

    Raises:
        MatlabError: it is newer or damaged.
    """
    command = [sys.executable, "-P", __file__, str(path)]
    done = subprocess.run(command, capture_output=True, check=False)
    if done.returncode < 0:
        raise MatlabError(f"SciPy's reader ended by signal {-done.returncode}")
    if done.returncode:
        raise MatlabError(done.stderr.decode(errors="replace"))
    with np.load(io.BytesIO(done.stdout), allow_pickle=False) as found:
        names = found["names"].tolist()
        return {name: found[f"arr_{i}"] for i, name in enumerate(names)}


def _members(values: Mapping[str, Any], prefix: str = "") -> Arrays:
    found = Arrays()
    for name, value in values.items():
        if name.startswith("__"):
            continue
        if isinstance(value, dict):
            found |= _members(value, f"{prefix}{name}.")
        else:
            found[prefix + name] = _plain(value)
    return found


def _plain(value: Any) -> np.ndarray:
    """Returns an array, of numbers or of the letters that stand for others."""
    array = np.asarray(value)
    return array if array.dtype.kind in "fiubc" else np.array(["no numbers"])


def _main(path: str) -> int:
    """Writes the arrays to the standard output; returns the exit status."""
    from scipy.io import loadmat

    try:
        arrays = _members(loadmat(path, simplify_cells=True))
    except NotImplementedError:
        print("MATLAB 7.3; save it with -v7, or as CSV", end="", file=sys.stderr)
        return 1
    except Exception as error:  # of damage it may be anything
        print(str(error) or type(error).__name__, end="", file=sys.stderr)
        return 1
    # Whole, then sent: what goes wrong half way would be half a file.
    stream = io.BytesIO()
    np.savez(stream, *arrays.values(), names=np.array(list(arrays), dtype=str))
    sys.stdout.buffer.write(stream.getbuffer())
    return 0


if __name__ == "__main__":
    sys.exit(_main(sys.argv[1]))
