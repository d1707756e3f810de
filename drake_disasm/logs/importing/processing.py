"""From recordings of joints to rows of a log: even, filtered, with derivatives."""

import dataclasses
import itertools
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drake_disasm.common.errors import DisasmError
from drake_disasm.logs.importing.cutoff import (
    MotionSpectrum,
    chosen_cutoff,
    motion_spectra,
)
from drake_disasm.logs.importing.recording import Recording
from drake_disasm.logs.importing.signals import (
    Clock,
    LowPass,
    clock_of,
    even_times,
    quantum,
    resample,
    stretches,
)

Array = NDArray[np.float64]

_FEWEST = 4  # rows of a stretch
_SAME = 1e-3  # by which periods of two recordings may differ
_BRIDGED = 0.25  # of the cut-off's period: so long a gap hides nothing of what passes


@dataclasses.dataclass(frozen=True)
class ImportProcessing:
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
        spectra: of each recording's joints that move.
        over_velocity: rms of each joint's acceleration by that of the slope of its
            recorded velocity; empty if that is not recorded.
    """

    clocks: tuple[Clock, ...]
    cutoff: float
    reach: int
    decimation: int
    quanta: dict[str, float]
    resampled: int
    short: int = 0
    spectra: tuple[tuple[MotionSpectrum, ...], ...] = ()
    over_velocity: dict[int, float] = dataclasses.field(default_factory=dict)

    @property
    def noise(self) -> dict[int, float]:
        """The most noise in each joint's acceleration, as a share of its rms.

        By the joint's number, of those whose motion stands out of the noise.
        """
        found: dict[int, float] = {}
        for each in itertools.chain(*self.spectra):
            if each.is_resolved:
                share = each.noise_share(self.cutoff)
                found[each.joint] = max(share, found.get(each.joint, 0.0))
        return found

    @property
    def noisy(self) -> list[int]:
        """Numbers of the joints that move, but not clearly more than their noise."""
        spectra = itertools.chain(*self.spectra)
        return sorted({each.joint for each in spectra if not each.is_resolved})


@dataclasses.dataclass(frozen=True)
class _Stretch:
    """What was recorded between two gaps.

    Attributes:
        even: its rows, a period apart.
        recorded: how many there were.
    """

    even: Recording
    recorded: int


def process(
    recordings: Sequence[Recording], processing: ImportProcessing
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
    coarse = [_stretches(each, period) for each in recordings]
    if not any(coarse):
        raise DisasmError(
            f"no stretch of {_FEWEST} rows is without gaps; record without losses"
        )
    spectra = tuple(_spectra(found, period) for found in coarse)
    cutoff = _cutoff_of(spectra, period, processing)
    low = LowPass(cutoff, period) if math.isfinite(cutoff) else None
    parts = [
        part
        for each, clock, found in zip(recordings, clocks, coarse, strict=True)
        for part in _joined(each, clock, found, period, cutoff)
    ]
    decimation = processing.decimate or (low.decimation if low else 1)
    found = [_filtered(part.even, low, decimation) for part in parts]
    kept = [each for each in found if each is not None]
    if not kept:
        longest = max(len(part.even.time) for part in parts)
        raise DisasmError(
            f"no stretch without gaps is longer than the filter: {longest} rows, and "
            f"it takes {2 * low.reach if low else 0}; give a higher `cutoff`, or none"
        )
    return kept, Done(
        clocks,
        cutoff,
        low.reach if low else 0,
        decimation,
        _quanta(recordings),
        sum(not clock.is_even for clock in clocks),
        sum(len(each.time) for each in recordings) - _used(parts, found),
        spectra,
        _over_velocity([part.even for part in parts], low),
    )


def _joined(
    recording: Recording,
    clock: Clock,
    found: list[_Stretch],
    period: float,
    cutoff: float,
) -> list[_Stretch]:
    """Returns the stretches found, joined over gaps that hide nothing of what passes.

    Args:
        recording: that they are of.
        clock: of it.
        found: between all gaps.
        period: of even rows [s].
        cutoff: of the filter [Hz].
    """
    bridged = _BRIDGED / cutoff
    if all(gap > bridged for gap in clock.gaps):
        return found
    return _stretches(recording, period, bridged)


def _over_velocity(parts: Sequence[Recording], low: LowPass | None) -> dict[int, float]:
    """Returns how positions' accelerations compare to recorded velocities' slopes."""
    if low is None or "v" not in parts[0].columns:
        return {}
    rows = [part.columns for part in parts if len(part.time) > 2 * low.reach]
    of_q, of_v = (
        sum(np.sum(low(columns[name], order) ** 2, axis=0) for columns in rows)
        for name, order in (("q", 2), ("v", 1))
    )
    ratios = np.sqrt(of_q / np.maximum(of_v, 1e-300))
    return {n: float(ratios[n]) for n in range(len(ratios)) if of_v[n] > 0.0}


def _used(parts: Sequence[_Stretch], found: Sequence[Processed | None]) -> int:
    """Returns how many recorded rows are in stretches that are long enough."""
    pairs = zip(parts, found, strict=True)
    return sum(part.recorded for part, kept in pairs if kept is not None)


def _spectra(found: Sequence[_Stretch], period: float) -> tuple[MotionSpectrum, ...]:
    """Returns those of the joints that move, of a recording's stretches."""
    positions = [part.even.columns["q"] for part in found]
    return tuple(motion_spectra(positions, period)) if positions else ()


def _cutoff_of(
    spectra: Sequence[Sequence[MotionSpectrum]],
    period: float,
    processing: ImportProcessing,
) -> float:
    """Returns the cut-off [Hz] that is wanted, or that the motion asks for."""
    cutoff = processing.cutoff
    if cutoff is None:
        cutoff = chosen_cutoff(itertools.chain(*spectra), period)
    if math.isfinite(cutoff) and cutoff >= 0.5 / period:
        raise DisasmError(
            f"`cutoff` {cutoff:g}: is not below half the sampling rate, "
            f"{0.5 / period:.4g} Hz; give a lower one, or none"
        )
    return cutoff


def _stretches(
    recording: Recording, period: float, bridged: float = 0.0
) -> list[_Stretch]:
    """Returns what is between gaps; those up to a time `bridged` [s] are none."""
    found = []
    for rows in stretches(recording.time, bridged):
        time = recording.time[rows]
        if len(time) < _FEWEST:
            continue
        part = {name: values[rows] for name, values in recording.columns.items()}
        clock = clock_of(time)
        if not clock.is_even or abs(clock.period - period) > _SAME * period:
            at = even_times(time, period)
            part = {name: resample(time, values, at) for name, values in part.items()}
            time = at
        even = dataclasses.replace(recording, time=time, columns=part)
        found.append(_Stretch(even, len(recording.time[rows])))
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
