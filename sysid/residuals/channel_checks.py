"""What a channel's residual shows by itself, whatever effects explain of it.

More than its noise, a line in its spectrum, rows that are missed by far more than all
others: each is something that a verdict must not be silent about.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, f

from sysid.data_checks.tails import tail_limit
from sysid.fitting.fit import Fit
from sysid.fitting.settings import SelectionSettings
from sysid.identification.uncertainty import block_length
from sysid.identification.whiteness import autocorrelation
from sysid.models.base import HUBER_DELTA
from sysid.models.measurements import Measurements
from sysid.objective import pseudo_residual

Array = NDArray[np.float64]

_NEAR_ROW = 3.0  # standard deviations, within which no row is outlying, if stated
_NEAR = 2  # frequencies over which a window spreads a line
_FINE = 41  # frequencies between a line's neighbours
_SHOWN = 5  # rows that a text lists: a size of output, no threshold
_ALPHA = 0.001  # of one check of one channel: a verdict has two dozen of them
_OUTLYING_ALPHA = 0.003  # that a channel's largest row is beyond what its tail says
_OUTLYING = 4.0  # times what nine of ten rows are below: no outlier is smaller
_LINE_ALPHA = 1e-4  # stricter: the spectrum around a line is taken for smooth
_LINE_POWER = 0.2  # share of a channel's power
_NEIGHBOURS = 8  # frequencies on either side that a line is compared with


@dataclass(frozen=True)
class ChannelFinding:
    """Something that is left in a channel.

    Attributes:
        channel: its name.
        text: what it is, in words.
        is_of_rows: whether it is of single rows.
    """

    channel: str
    text: str
    is_of_rows: bool = False


def channel_findings(fit: Fit) -> list[ChannelFinding]:
    """Returns what is left in each channel of a fit's residual."""
    measured, residual = fit.model.measurements, fit.weighed_residual
    found = []
    for number, channel in enumerate(measured.channels):
        r = residual[:, number]
        least = fit.noticeable(number)
        rows = _outlying(r, measured, max(_NEAR_ROW, least) if least else 0.0)
        line = _line(r, measured, least)
        excess = _excess(r, measured, fit.settings) if fit.noise_is_stated else ""
        texts = ((rows, True), (line, False), (excess, False))
        found += [ChannelFinding(channel.name, *each) for each in texts if each[0]]
    return found


def _excess(r: Array, measured: Measurements, settings: SelectionSettings) -> str:
    """Returns by how much a residual (n,) is more than the noise that is stated.

    A residual that is correlated over b rows has n / b degrees of freedom. Single rows
    that are missed by far do not count: they are outlying.
    """
    size = float(np.sqrt(np.mean(pseudo_residual(r, HUBER_DELTA) ** 2)))
    freedom = len(r) / block_length(r[:, None], measured.episode)
    p = float(chi2.sf(size**2 * freedom, freedom))
    if size < settings.max_objective_at_noise or p > _ALPHA:
        return ""
    return f"{size:.2g} times its noise, of unknown origin"


def _outlying(r: Array, measured: Measurements, least: float) -> str:
    """Returns which rows of a residual (n,) are beyond what its tail has elsewhere.

    Of heavy-tailed noise no row is outlying.
    """
    limit, usual = tail_limit(r, _OUTLYING_ALPHA)
    if not usual:
        return ""
    limit = max(limit, _OUTLYING * usual, least)
    rows = np.flatnonzero(np.abs(r) > limit)
    if not len(rows):
        return ""
    names = [measured.names[i] for i in np.unique(measured.episode[rows])]
    where = f" in {', '.join(names[:_SHOWN])}{' ...' if len(names) > _SHOWN else ''}"
    what = "1 outlying row" if len(rows) == 1 else f"{len(rows)} outlying rows"
    more = " ..." if len(rows) > _SHOWN else ""
    numbers = ", ".join(str(i) for i in rows[:_SHOWN]) + more
    return f"{what}{where} (row {numbers})"


def _line(r: Array, measured: Measurements, least: float) -> str:
    """Returns the frequency at which a residual (n,) is periodic, in words.

    The episodes' periodograms are averaged; a line is a frequency that stands out of
    those around it, by an F-test, over all frequencies (Bonferroni). What the row
    before predicts is taken out first, which makes the spectrum about level.
    """
    parts = [r[measured.episode == e] for e in range(len(measured.names))]
    longest = max(len(part) for part in parts)
    parts = [part for part in parts if len(part) > longest // 2]
    power = np.mean([_periodogram(part, longest) for part in parts], axis=0)
    level = np.mean([_periodogram(_innovations(p), longest) for p in parts], axis=0)
    bins = range(_NEAR, len(power) - 1)
    if not bins or not power.any():
        return ""
    around = [_around(level, bin_, _NEIGHBOURS) for bin_ in bins]
    ratio = np.array([level[b] / a.mean() for b, a in zip(bins, around, strict=True)])
    best = int(np.argmax(ratio))
    freedom = 2 * len(parts)
    tail = f.sf(ratio[best], freedom, freedom * len(around[best]))
    share = float(power[bins[best] - 1 : bins[best] + 2].sum() / power[1:].sum())
    is_small = share < _LINE_POWER or share * np.mean(r**2) < least**2
    if is_small or len(bins) * tail > _LINE_ALPHA:
        return ""
    cycles = _refined(parts, bins[best], longest)
    if measured.period:
        return f"periodic at {cycles / measured.period:.2g} Hz ({100 * share:.0f} %)"
    return f"periodic, every {1.0 / cycles:.2g} rows ({100 * share:.0f} %)"


def _refined(parts: Sequence[Array], bin_: int, longest: int) -> float:
    """Returns the frequency [1/row] near a bin at which parts have the most power.

    Between the periodogram's own frequencies, which are far apart in short episodes.
    """
    cycles = (bin_ + np.linspace(-1.0, 1.0, _FINE)) / longest
    power = np.zeros_like(cycles)
    for part in parts:
        waves = np.exp(-2j * np.pi * np.outer(cycles, np.arange(len(part))))
        power += np.abs(waves @ _windowed(part)) ** 2
    return float(cycles[np.argmax(power)])


def _around(level: Array, bin_: int, count: int) -> Array:
    """Returns the power at so many frequencies on either side, but the nearest."""
    below = level[max(bin_ - _NEAR - count, 1) : max(bin_ - _NEAR + 1, 1)]
    above = level[bin_ + _NEAR : bin_ + _NEAR + count]
    return np.concatenate([below, above])


def _innovations(part: Array) -> Array:
    """Returns what the row before does not predict of each."""
    centred = part - part.mean()
    rho = autocorrelation(part, 1)[0]
    return np.asarray(centred[1:] - rho * centred[:-1])


def _periodogram(part: Array, longest: int) -> Array:
    return np.abs(np.fft.rfft(_windowed(part), longest)) ** 2


def _windowed(part: Array) -> Array:
    window = np.hanning(len(part) + 2)[1:-1]
    return np.asarray((part - part.mean()) * window / np.linalg.norm(window))
