"""Signal processing of recorded motions, as the field does it.

One zero-phase low-pass filter acts on everything that an equation of motion holds, so
that the equation holds of what comes out (Gautier, 1997): a symmetric FIR kernel, a
sinc with Blackman's window, which ends smoothly (Oppenheim and Schafer, 2010, section
7.5; the stop band is down by 74 dB). Velocity and acceleration come from the position
by the derivatives of that same kernel, which is exact: d/dt (h * q) = h' * q. Where the
kernel reaches beyond the record there is no result; those ends are left out.
"""

import dataclasses
import itertools

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline
from scipy.signal import oaconvolve

Array = NDArray[np.float64]

_TRANSITION = 0.8  # of the cut-off: width of the transition band
LARGEST_CUTOFF = 0.6  # of the Nyquist frequency, of any filter
_ROWS_PER_PERIOD = 10.0  # of the cut-off, after decimation
_JITTER = 0.01  # of the period: below it rows are taken as evenly spaced
_FINE = 16  # points of the continuous kernel between taps
_COUNTED = 10.5  # quanta: steps up to there must be multiples
_FASTER = 2.0  # times the largest step: a joint's speed does not double within a row
_GAP = 5.0  # periods without a row: a longer one ends a stretch


@dataclasses.dataclass(frozen=True)
class Clock:
    """How a record was sampled.

    Attributes:
        period: median time between rows [s].
        jitter: spread of the time between rows, gaps left out [s].
        gaps: times between rows that are longer than five periods [s].
        lost: rows that are missing, gaps left out.
        repeated: rows whose time does not increase.
    """

    period: float
    jitter: float
    gaps: tuple[float, ...]
    lost: int
    repeated: int

    @property
    def is_even(self) -> bool:
        """Whether rows may be taken as evenly spaced."""
        even = self.jitter < _JITTER * self.period
        return even and not (self.gaps or self.lost or self.repeated)


def clock_of(time: Array) -> Clock:
    """Returns how times (n,) [s] follow one another."""
    steps = np.diff(time)
    period = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    is_gap = steps > _GAP * period
    near = steps[(steps > 0) & ~is_gap]
    missing = np.maximum(np.round(near / period) - 1, 0) if period else near
    single = near[missing == 0]
    return Clock(
        period=period,
        jitter=float(single.std()) if len(single) else 0.0,
        gaps=tuple(float(step) for step in steps[is_gap]),
        lost=int(missing.sum()),
        repeated=int((steps <= 0).sum()),
    )


def stretches(time: Array, bridged: float = 0.0) -> list[slice]:
    """Returns the rows between gaps of increasing times (n,).

    Args:
        time: (n,) [s].
        bridged: gaps up to this long are none [s].
    """
    longest = max(_GAP * clock_of(time).period, bridged)
    ends = np.nonzero(np.diff(time) > longest)[0] + 1
    edges = [0, *ends, len(time)]
    return [slice(first, end) for first, end in itertools.pairwise(edges)]


def resample(time: Array, values: Array, at: Array) -> Array:
    """Returns values (n, k) at other times (m,), by cubic splines.

    Args:
        time: (n,) increasing [s].
        values: (n, k).
        at: (m,) within `time` [s].
    """
    return np.asarray(make_interp_spline(time, values, k=min(3, len(time) - 1))(at))


def unwrapped(time: Array, q: Array) -> tuple[Array, NDArray[np.int64]]:
    """Returns positions (n, k) without jumps of whole turns, and how many (k,).

    An encoder wraps if, jumps taken out, its joint moves in all its steps by less than
    a quarter turn, and there about as fast as elsewhere. Others are left as they are.

    Args:
        time: (n,) [s]; steps over gaps are not looked at.
        q: (n, k) [rad].
    """
    if len(time) < 2:
        return q, np.zeros(q.shape[1], dtype=np.int64)
    turned = np.unwrap(q, axis=0)
    steps, jumps = np.abs(np.diff(turned, axis=0)), np.abs(np.diff(q, axis=0)) > np.pi
    near = (np.diff(time) <= _GAP * clock_of(time).period)[:, None]
    usual = np.max(steps, axis=0, initial=0.0, where=near & ~jumps)
    there = np.max(steps, axis=0, initial=0.0, where=near & jumps)
    wraps = (usual < 0.5 * np.pi) & (there <= _FASTER * usual)
    counts = np.sum(near & jumps, axis=0) * wraps
    return np.where(counts > 0, turned, q), counts


def longest_stretch(time: Array) -> slice:
    """Returns the rows of the longest stretch between gaps of increasing times (n,)."""
    return max(stretches(time), key=lambda rows: rows.stop - rows.start)


def even_times(time: Array, period: float | None = None) -> Array:
    """Returns even times (m,) from the first to the last.

    Args:
        time: (n,) increasing [s], without gaps.
        period: between them [s]; None for the median of `time`.
    """
    period = clock_of(time).period if period is None else period
    count = int(np.floor((time[-1] - time[0]) / period * (1.0 + 1e-9))) + 1
    return time[0] + period * np.arange(count)


@dataclasses.dataclass(frozen=True)
class LowPass:
    """A zero-phase low-pass filter, and the derivatives of what it lets through.

    Attributes:
        cutoff: half amplitude there [Hz].
        period: of the rows [s].
    """

    cutoff: float
    period: float

    @property
    def reach(self) -> int:
        """Rows on either side that a result depends on, and that each end loses."""
        return int(np.ceil(3.0 / (_TRANSITION * self.cutoff * self.period)))

    def kernel(self, order: int = 0) -> Array:
        """Returns the taps (2 reach + 1,) of the filter's derivative.

        Args:
            order: 0 for the filter itself, 1 or 2 for a derivative [1/s, 1/s^2].
        """
        t = np.arange(-self.reach * _FINE, self.reach * _FINE + 1) / _FINE
        turn = np.pi * t / self.reach
        window = 0.42 + 0.5 * np.cos(turn) + 0.08 * np.cos(2.0 * turn)
        taps = np.sinc(2.0 * self.cutoff * self.period * t) * window
        spline = make_interp_spline(t, taps, k=5)
        n = np.arange(-self.reach, self.reach + 1, dtype=float)
        own = np.asarray(spline(n, nu=order)) / np.sum(taps[::_FINE])
        if order:
            own -= own.mean()  # nothing of a constant
        return own / self.period**order

    def __call__(self, values: Array, order: int = 0) -> Array:
        """Returns filtered values (n - 2 reach, k), or their derivatives.

        Args:
            values: (n, k), a period apart.
            order: as of `kernel`.
        """
        taps = self.kernel(order)[:, None]
        return np.asarray(oaconvolve(values, taps, mode="valid", axes=0))

    @property
    def decimation(self) -> int:
        """Every how many rows hold all that is let through, five times over."""
        rate = _ROWS_PER_PERIOD * self.cutoff
        return max(1, int(1.0 / (rate * self.period)))


def quantum(values: Array) -> float:
    """Returns the step to which values (n,) are rounded; 0 if they are not.

    They are if every difference between them is a multiple of the smallest.
    """
    steps = np.diff(np.unique(values))
    if not len(steps):
        return 0.0
    # What rounding in floating point makes of equal values.
    steps = steps[steps > 1e-9 * np.ptp(values)]
    if not len(steps):
        return 0.0
    least = float(steps.min())
    smallest = float(np.median(steps[steps < 1.5 * least]))
    share = steps[steps < _COUNTED * smallest] / smallest
    is_multiple = np.abs(share - np.round(share)) < 0.1
    is_rounded = len(values) > 2 * len(steps) and 2 * len(share) > len(steps)
    return smallest if is_rounded and is_multiple.all() else 0.0
