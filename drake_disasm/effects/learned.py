"""Functions that were learned from data: boosted regression trees, and their file.

A file holds arrays alone (NumPy's `.npz`, without pickle), so that reading one runs
nothing. Outside the range of the data a function is zero.
"""

import dataclasses
import functools
from collections.abc import Mapping
from pathlib import Path
from typing import Self

import numpy as np

from drake_disasm.common.errors import DisasmError

_MOST_BYTES = 64 * 2**20
_PARTS = ("feature", "threshold", "children", "value", "base", "low", "high")


@dataclasses.dataclass(frozen=True)
class BoostedTrees:
    """A sum of binary regression trees, all of so many nodes.

    Attributes:
        feature: (trees, nodes) input that a node looks at; -1 at a leaf.
        threshold: (trees, nodes) up to which it goes on to its first child.
        children: (trees, nodes, 2) nodes; a leaf is its own child.
        value: (trees, nodes) of a leaf, in the output's unit.
        base: () what is added to the trees' sum.
        low, high: (k,) range of each input in the data.
    """

    feature: np.ndarray
    threshold: np.ndarray
    children: np.ndarray
    value: np.ndarray
    base: np.ndarray
    low: np.ndarray
    high: np.ndarray

    def __call__(self, inputs: np.ndarray) -> np.ndarray:
        """Returns the function (n,) of inputs (n, k); zero outside the data's range."""
        seen = inputs.astype(np.float32)  # as they were learned
        rows = np.arange(len(inputs))[:, None]
        trees = np.arange(len(self.feature))[None]
        node = np.zeros((len(inputs), len(self.feature)), dtype=np.int64)
        while True:
            feature = self.feature[trees, node]
            if np.all(feature < 0):
                break
            above = seen[rows, np.maximum(feature, 0)] > self.threshold[trees, node]
            node = self.children[trees, node, above.astype(np.int64)]
        total = self.base + self.value[trees, node].sum(axis=1)
        inside = np.all((inputs >= self.low) & (inputs <= self.high), axis=1)
        return np.asarray(np.where(inside, total, 0.0))


@dataclasses.dataclass(frozen=True)
class LearnedFunctions:
    """Functions by the names of what they predict.

    Attributes:
        inputs: names of what each of them takes.
        outputs: the functions.
    """

    inputs: tuple[str, ...]
    outputs: Mapping[str, BoostedTrees]

    def save(self, path: Path) -> None:
        """Writes the functions to a file `.npz`."""
        arrays = {
            f"{name}/{part}": getattr(trees, part)
            for name, trees in self.outputs.items()
            for part in _PARTS
        }
        with path.open("wb") as stream:
            np.savez_compressed(stream, inputs=np.array(self.inputs), **arrays)

    @classmethod
    def load(cls, path: Path) -> Self:
        """Returns the functions of a file.

        Raises:
            DisasmError: it can't be read, is too large, or is of something else.
        """
        remedy = "name the file that closing the loop wrote beside its scenario"
        try:
            if path.stat().st_size > _MOST_BYTES:
                raise DisasmError(f"{path}: above 64 MiB; {remedy}")
            with np.load(path, allow_pickle=False) as arrays:
                names = tuple(str(name) for name in arrays["inputs"])
                outputs = {key.partition("/")[0] for key in arrays} - {"inputs"}
                found = {
                    name: BoostedTrees(*(arrays[f"{name}/{p}"] for p in _PARTS))
                    for name in sorted(outputs)
                }
        except (OSError, ValueError, KeyError, EOFError) as error:
            reason = " ".join(str(error).split())
            raise DisasmError(f"{path}: can't be read ({reason}); {remedy}") from None
        return cls(names, found)


def learned_functions(file: str, inputs: tuple[str, ...]) -> LearnedFunctions:
    """Returns the functions of a file, which is read once.

    Raises:
        DisasmError: it can't be read, or they take other inputs.
    """
    path = Path(file)
    changed = path.stat().st_mtime_ns if path.is_file() else 0
    found = _loaded(path, changed)
    if found.inputs != inputs:
        raise DisasmError(
            f"{file}: its functions take {', '.join(found.inputs)}, this effect has "
            f"{', '.join(inputs)}; name the file that was made for it"
        )
    return found


@functools.lru_cache(maxsize=16)
def _loaded(path: Path, changed: int) -> LearnedFunctions:
    return LearnedFunctions.load(path)
