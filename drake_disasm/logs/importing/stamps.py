"""Stamps of arrival told from stamps of sampling, and made even.

A driver that samples evenly and stamps what it gets when it gets it adds its host's and
network's delays to the times. Over one step the position changes by v dt of the true
step, so that the positions say which times are right: those over which their changes
are what a slope over many rows makes of them.
"""

import dataclasses
import itertools

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from drake_disasm.logs.importing.signals import clock_of

Array = NDArray[np.float64]

_HALF = 10  # rows on either side that a slope is of, over which jitter averages out
_MANY = 101  # rows, of most of which the staircase is right
_FEWEST = 100  # rows that tell anything
_MOST_ROWS = 1e12
_BLOCKS = 10  # of the record, for the spread of what the positions say
_SURE = 2.0  # standard errors
_NORMAL_MEDIAN = 0.6745  # of a normal variable's absolute value
_CERTAIN = 4.0  # standard deviations, from a whole step to half a step off
_RANGE = 0.01  # of the period, within which it is refined
_STEPS = 401


@dataclasses.dataclass(frozen=True)
class Evened:
    """Even times in place of stamps.

    Attributes:
        time: (n,) multiples of the period, but for a constant between two pauses [s].
        period: of sampling [s].
        jitter: standard deviation of the stamps about `time` [s].
        lost: rows that are missing.
    """

    time: Array
    period: float
    jitter: float
    lost: int

    def words(self) -> str:
        """Returns what was found and done."""
        return (
            f"stamps are of arrival, since the positions follow even times better: "
            f"{1e3 * self.jitter:.2g} ms about {1.0 / self.period:.4g} Hz; even times "
            f"are taken, {self.lost} rows are missing"
        )


def evened(time: Array, q: Array, sequence: Array | None = None) -> Evened | None:
    """Returns even times, if the stamps are those of arrival; None to take the stamps.

    Args:
        time: (n,) stamps that do not decrease [s].
        q: (n, j) positions.
        sequence: (n,) numbers of the rows, of which some are missing; None if unknown.
    """
    clock = clock_of(time)
    if (np.diff(time) < 0.0).any() or clock.is_even:
        return None
    # Over a pause nothing tells how many rows there would have been.
    ends = np.flatnonzero(np.diff(time) > (2 * _HALF + 1) * clock.period) + 1
    edges = [0, *ends.tolist(), len(time)]
    parts = [slice(*ends) for ends in itertools.pairwise(edges)]
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        found = {
            (part.start, part.stop): _of_stretch(
                time[part], q[part], None if sequence is None else sequence[part]
            )
            for part in parts
        }
    known = [each for each in found.values() if each]
    if not known:
        return None
    times = [e.time if e else time[slice(*ends)] for ends, e in found.items()]
    return Evened(
        np.concatenate(times),
        float(np.median([each.period for each in known])),
        float(np.sqrt(np.mean([each.jitter**2 for each in known]))),
        sum(each.lost for each in known),
    )


def _of_stretch(time: Array, q: Array, sequence: Array | None) -> Evened | None:
    """Returns even times of a stretch without a pause; see `evened`."""
    if len(time) < _FEWEST or clock_of(time).is_even:
        return None
    rows, slope, change = _slopes(time, q)
    speed = np.sum(slope**2, axis=1)
    moving = speed > np.median(speed)
    if not moving.any():
        moving = speed > 0.0
    if not moving.any():
        return None
    steps = np.sum(change * slope, axis=1)[moving] / speed[moving]
    period = float(np.median(steps))
    if not period > 0.0:
        return None
    count = _placed(_counts(time, period), time, q)
    if not (np.abs(count) < _MOST_ROWS).all():
        return None  # the positions are damaged
    if sequence is not None:  # a node may skip rows that it doesn't number
        numbered = sequence - sequence[0]
        count = np.maximum.accumulate(count - numbered) + numbered
    period = _fitted(count, time)
    if not period > 0.0:
        return None
    says = _evidence(time, period * count, rows, slope, change)
    if not says >= _SURE:
        return None
    late = time - period * count
    if clock_of(late + period * np.arange(len(late))).is_even:
        return None  # rows are missing, and that is all
    return Evened(
        period * count + late.min(),  # nothing arrives before it is sampled
        period,
        float(late.std()),
        int(count[-1]) - len(count) + 1,
    )


def _slopes(time: Array, q: Array) -> tuple[NDArray[np.int_], Array, Array]:
    """Returns rows i, slopes of q over many rows about them, and q[i + 1] - q[i]."""
    rows = np.arange(_HALF, len(time) - _HALF - 1)
    ahead, behind = rows + _HALF + 1, rows - _HALF
    span = np.maximum(time[ahead] - time[behind], np.finfo(float).tiny)
    slope = (q[ahead] - q[behind]) / span[:, None]
    return rows, slope, q[rows + 1] - q[rows]


def _fitted(count: Array, time: Array) -> float:
    """Returns the slope of a straight line through times [s] over counts."""
    about = count - count.mean()
    return float(about @ (time - time.mean()) / max(float(about @ about), 1e-300))


def _counts(time: Array, period: float) -> Array:
    """Returns how many periods (n,) after the first each row was sampled.

    No row arrives before it is sampled, and some soon after: the least of what all
    later stamps are late is a staircase, which rises by a period where a row was lost.
    The period is refined to where its steps are whole ones.

    Args:
        time: (n,) stamps [s].
        period: about that of sampling [s].
    """
    number = np.arange(len(time))

    def stairs(step: float) -> Array:
        """Returns the staircase in periods."""
        late = (time - time[0]) / step - number
        least = np.minimum.accumulate(late[::-1])[::-1]
        return np.asarray(least - least[0])

    def misfit(step: float) -> float:
        """Returns how far its steps are from whole ones."""
        found = stairs(step)
        return float(np.mean((found - np.round(found)) ** 2))

    grid = period * np.linspace(1.0 - _RANGE, 1.0 + _RANGE, _STEPS)
    best = float(grid[np.argmin([misfit(step) for step in grid])])
    return np.asarray(number + np.round(stairs(best)))


def _placed(count: Array, time: Array, q: Array) -> Array:
    """Returns the counts (n,) with missing rows where the positions jump over them.

    A row after missing ones is often stamped late, so that the staircase has them some
    rows too early. Where the joints move fast enough to tell, the steps of the count
    are those that the changes of position are of; the staircase says what these come
    to over many rows.

    Args:
        count: (n,) by `_counts`.
        time: (n,) stamps [s].
        q: (n, j) positions.
    """
    even = _fitted(count, time) * count
    rows, slope, change = _slopes(even, q)
    period = _fitted(count, time)
    speed = np.sqrt(np.sum(slope**2, axis=1))
    fast = speed > np.median(speed)
    if not fast.any():
        return count
    moved = np.zeros(len(rows))
    np.divide(np.sum(change * slope, axis=1), speed**2 * period, moved, where=speed > 0)
    off = np.abs(moved - np.round(moved)) * speed * period
    noise = float(np.median(off[fast])) / _NORMAL_MEDIAN
    certain = (0.5 * speed * period > _CERTAIN * noise) & (np.round(moved) >= 1.0)
    steps = np.diff(count)
    steps[rows[certain]] = np.round(moved[certain])
    placed = np.concatenate([[0.0], np.cumsum(steps)])
    apart = median_filter(count - placed, _MANY, mode="nearest")
    number = np.arange(len(count))
    # Where the two part for good the positions are wrong; no row is before another.
    later = np.maximum.accumulate(placed + np.round(apart) - number)
    return np.asarray(later - later[0] + number)


def _evidence(
    time: Array, even: Array, rows: NDArray[np.int_], slope: Array, change: Array
) -> float:
    """Returns by how many standard errors the changes of position favour even times."""

    def misfit(times: Array) -> Array:
        """Returns squares of what steps in time do not explain (m,)."""
        step = (times[rows + 1] - times[rows])[:, None]
        return np.asarray(np.sum((change - slope * step) ** 2, axis=1))

    blocks = np.array_split(misfit(time) - misfit(even), _BLOCKS)
    means = np.array([block.mean() for block in blocks])
    spread = float(means.std(ddof=1)) / np.sqrt(_BLOCKS)
    return float(means.mean()) / spread if spread > 0.0 else 0.0
