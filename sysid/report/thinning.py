"""Which rows of a long series a figure draws, so that a page stays small."""

import itertools

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def extreme_rows(values: Array, most: int) -> NDArray[np.int64]:
    """Returns the numbers of at most so many rows, with all peaks among them.

    Of each stretch of rows, those where any of the series is least or greatest.

    Args:
        values: (rows, series).
        most: rows.
    """
    rows, series = values.shape
    if rows <= most:
        return np.arange(rows)
    stretches = max(1, most // (2 * series))
    edges = np.linspace(0, rows, stretches + 1).astype(np.int64)
    found = []
    for begin, end in itertools.pairwise(edges):
        part = values[begin:end]
        found += [begin + part.argmin(axis=0), begin + part.argmax(axis=0)]
    return np.unique(np.concatenate(found))


def even_rows(rows: int, most: int) -> NDArray[np.int64]:
    """Returns the numbers of at most so many rows at even distances."""
    return np.unique(np.linspace(0, rows - 1, min(rows, most)).astype(np.int64))
