"""From recordings of joints to rows of a log: even, filtered, with derivatives."""

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drake_disasm.common.errors import DisasmError
from drake_disasm.importing.recording import Recording
from drake_disasm.importing.signals import (
    Clock,
    LowPass,
    chosen_cutoff,
    clock_of,
    even_times,
    quantum,
    resample,
    stretches,
)

Array = NDArray[np.float64]

_FEWEST = 4  # rows of a stretch
_SAME = 1e-3  # by which periods of two recordings may differ


@dataclasses.dataclass(frozen=True)
class Processing:
    """What is done to recorded signals.

    Attributes:
        cutoff: of the low-pass filter [Hz]; None to choose it from the spectrum, inf
            for none.
        decimate: keep every so many rows; None for what the cut-off asks for.
        between: times since the begin of each recording that are kept [s].
    """

    cutoff: float | None = None
    decimate: int | None = None
    between: tuple[float, float] = (0.0, math.inf)


@dataclasses.dataclass(frozen=True)
class Processed:
    """Rows of one stretch, ready for a log.

    Attributes:
        recording: which it is from.
        columns: (n,) time and (n, k) of each quantity.
    """

    recording: Recording
    columns: dict[str, Array]


@dataclasses.dataclass(frozen=True)
class Done:
    """What was done, and what the data are like.

    Attributes:
        clocks: of each recording.
        cutoff: of the filter [Hz]; inf for none.
        reach: rows that each end of a stretch has lost.
        decimation: every how many rows are kept.
        quanta: steps to which columns are rounded, by "q.0"; those that are.
        resampled: recordings that were not sampled evenly.
        short: rows in stretches between gaps that are shorter than the filter.
    """

    clocks: tuple[Clock, ...]
    cutoff: float
    reach: int
    decimation: int
    quanta: dict[str, float]
    resampled: int
    short: int = 0


def process(
    recordings: Sequence[Recording], processing: Processing
) -> tuple[list[Processed], Done]:
    """Returns rows of a `joint_motion` log, and what was done to make them.

    One filter acts on all columns; velocity and acceleration, where they are not
    recorded, are the filter's derivatives of the position.

    Args:
        recordings: with positions "q".
        processing: as the user wants it.

    Raises:
        DisasmError: nothing is left of them.
    """
    clocks = tuple(clock_of(recording.time) for recording in recordings)
    period = float(np.median([clock.period for clock in clocks]))
    parts = [part for each in recordings for part in _even(each, period)]
    if not parts:
        raise DisasmError(
            f"no stretch of {_FEWEST} rows is without gaps; record without losses"
        )
    cutoff = _cutoff_of(parts, period, processing)
    low = LowPass(cutoff, period) if math.isfinite(cutoff) else None
    decimation = processing.decimate or (low.decimation if low else 1)
    found = [_filtered(part, low, decimation) for part in parts]
    kept = [each for each in found if each is not None]
    if not kept:
        longest = max(len(part.time) for part in parts)
        raise DisasmError(
            f"no stretch without gaps is longer than the filter: {longest} rows, and "
            f"it takes {2 * low.reach if low else 0}; give a higher `cutoff`, or none"
        )
    resampled = sum(not clock.is_even for clock in clocks)
    done = Done(
        clocks,
        cutoff,
        low.reach if low else 0,
        decimation,
        _quanta(recordings),
        resampled,
        _short(recordings, parts, found),
    )
    return kept, done


def _short(
    recordings: Sequence[Recording],
    parts: Sequence[Recording],
    found: Sequence[Processed | None],
) -> int:
    """Returns how many rows are in stretches of which nothing is left."""
    lengths = [
        rows.stop - rows.start for each in recordings for rows in stretches(each.time)
    ]
    tiny = sum(length for length in lengths if length < _FEWEST)
    pairs = zip(parts, found, strict=True)
    return tiny + sum(len(part.time) for part, kept in pairs if kept is None)


def _cutoff_of(
    parts: Sequence[Recording], period: float, processing: Processing
) -> float:
    """Returns the cut-off [Hz] that is wanted, or that the fastest stretch asks for."""
    cutoff = processing.cutoff
    if cutoff is None:
        cutoff = max(chosen_cutoff(part.columns["q"], period) for part in parts)
    if math.isfinite(cutoff) and cutoff >= 0.5 / period:
        raise DisasmError(
            f"`cutoff` {cutoff:g}: is not below half the sampling rate, "
            f"{0.5 / period:.4g} Hz; give a lower one, or none"
        )
    return cutoff


def _even(recording: Recording, period: float) -> list[Recording]:
    """Returns the stretches between gaps, in rows a period [s] apart."""
    found = []
    for rows in stretches(recording.time):
        time = recording.time[rows]
        if len(time) < _FEWEST:
            continue
        part = {name: values[rows] for name, values in recording.columns.items()}
        clock = clock_of(time)
        if not clock.is_even or abs(clock.period - period) > _SAME * period:
            at = even_times(time, period)
            part = {name: resample(time, values, at) for name, values in part.items()}
            time = at
        found.append(dataclasses.replace(recording, time=time, columns=part))
    return found


def _filtered(part: Recording, low: LowPass | None, every: int) -> Processed | None:
    """Returns the filtered rows of a stretch; None if it is shorter than the filter."""
    if low is None:
        columns = {"time": part.time, **part.columns}
        return Processed(part, {n: values[::every] for n, values in columns.items()})
    if len(part.time) < 2 * low.reach + 1 + 2 * every:
        return None
    columns = {"time": part.time[low.reach : -low.reach or None]}
    columns |= {name: low(values) for name, values in part.columns.items()}
    for order, name in ((1, "v"), (2, "vd")):
        if name not in columns:
            columns[name] = low(part.columns["q"], order)
    return Processed(part, {name: values[::every] for name, values in columns.items()})


def _quanta(recordings: Sequence[Recording]) -> dict[str, float]:
    found = {}
    for name in recordings[0].columns:
        stacked = np.concatenate([each.columns[name] for each in recordings])
        for i, column in enumerate(stacked.T):
            if step := quantum(column):
                found[f"{name}.{i}"] = step
    return found
