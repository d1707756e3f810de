"""Stretches over which a channel repeats one value, as recorded.

A sensor that stops, or is saturated, repeats a value exactly. A filter and resampling
hide that, so it is looked for before these, and kept in the log's provenance.
"""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_disasm.logs.importing.signals import quantum

Array = NDArray[np.float64]

#: Rows: a value that is repeated less often may be chance of a quantum.
FEWEST = 10
#: Of other rows, and values: where more are repeated, a channel is coarse, not stuck.
COARSE = 0.2
_ONE_STEP = 1.5  # quanta: less is one, rounded
#: Quantities; a robot may stand, and command nothing.
_MEASURED = ("tau", "current", "wrench", "ft_sensor")


@dataclass(frozen=True)
class Held:
    """A stretch over which a channel repeats one value.

    Attributes:
        begin, end: times of its first and last row [s].
        at_end: whether the value is the channel's least or greatest.
    """

    begin: float
    end: float
    at_end: bool

    def within(self, first: float, last: float, smeared: float) -> "Held | None":
        """Returns it on an episode's time line; None if it is not of that episode.

        Args:
            first, last: times of the episode's rows [s].
            smeared: time on either side that a filter mixes with it [s].
        """
        begin, end = max(self.begin - smeared, first), min(self.end + smeared, last)
        return Held(begin - first, end - first, self.at_end) if begin <= end else None


def held_rows(
    values: Sequence[Array], fewest: int = FEWEST, coarse: float = COARSE
) -> list[NDArray[np.bool_]]:
    """Returns at which rows a channel repeats a value, of each episode.

    All rows of an end value count if it is repeated anywhere: it is that of saturation.

    Args:
        values: (n,) of each episode.
        fewest: rows that repeat it.
        coarse: share of other rows that may repeat the one before, and of values
            that may be repeated so often.
    """
    everything = np.concatenate(values)
    step = quantum(everything)
    held = [_in_long_runs(own, fewest, step) for own in values]
    again = [np.diff(own, prepend=np.nan) == 0.0 for own in values]
    flagged, repeated = np.concatenate(held), np.concatenate(again)
    long = flagged[~repeated]  # runs, by their first rows: a coarse channel has several
    is_coarse = long.sum() > 1 and long.mean() > coarse
    is_stuck = flagged.any() and not flagged.all() and not is_coarse
    if not is_stuck or repeated[~flagged].mean() > coarse:
        return [np.zeros(len(own), dtype=bool) for own in values]
    ends = np.intersect1d(_ends(everything), everything[flagged])
    return [mask | np.isin(own, ends) for mask, own in zip(held, values, strict=True)]


def is_saturated(values: Array, held: NDArray[np.bool_]) -> bool:
    """Returns whether all values (n,) that are held are the least or greatest."""
    return bool(np.isin(values[held], _ends(values)).all())


def held_stretches(
    time: Array, columns: Mapping[str, Array]
) -> dict[str, tuple[Held, ...]]:
    """Returns the stretches over which measured channels repeat a value, by "tau.0".

    Args:
        time: (n,) [s].
        columns: (n, k) of each quantity, as recorded.
    """
    found = {}
    for name in set(_MEASURED) & set(columns):
        for number, own in enumerate(columns[name].T):
            [mask] = held_rows([own])
            ends = _ends(own)
            found[f"{name}.{number}"] = tuple(
                Held(float(time[a]), float(time[b - 1]), bool(own[a] in ends))
                for a, b in _runs(np.where(mask, own, np.nan))
            )
    return {name: stretches for name, stretches in found.items() if stretches}


def held_of(provenance: Mapping[str, Any], episode: str, column: str) -> list[Held]:
    """Returns what an import has written of an episode's column, as `Held`."""
    found: Any = provenance
    for key in ("import", "held", episode, column):
        found = found.get(key) if isinstance(found, Mapping) else None
    parts = found if isinstance(found, list) else []
    return [
        Held(float(part[0]), float(part[1]), bool(part[2]))
        for part in parts
        if isinstance(part, list)
        and len(part) == 3
        and all(isinstance(each, int | float) for each in part)
    ]


def _in_long_runs(values: Array, fewest: int, step: float) -> NDArray[np.bool_]:
    """Returns which rows (n,) belong to a long run of one value.

    A value that is reached and left by one quantum is that of a coarse channel which
    hardly changes, as at rest.

    Args:
        values: (n,).
        fewest: rows of a run.
        step: the channel's quantum; 0 for none.
    """
    begin = np.flatnonzero(np.diff(values, prepend=np.nan) != 0.0)
    length = np.diff(np.append(begin, len(values)))
    jumps = np.abs(np.diff(values[begin])) > _ONE_STEP * step
    is_held = np.append(jumps, False) | np.append(False, jumps)
    return np.repeat((length >= fewest) & is_held, length)


def _runs(values: Array) -> list[tuple[int, int]]:
    """Returns begins, and ends beyond, of runs of one value (n,) that is a number."""
    edges = np.flatnonzero(np.diff(values, prepend=np.nan, append=np.nan) != 0.0)
    pairs = itertools.pairwise(edges.tolist())
    return [(a, b) for a, b in pairs if np.isfinite(values[a])]


def _ends(values: Array) -> Array:
    return np.array([values.min(), values.max()])
