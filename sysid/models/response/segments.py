"""Episodes cut into segments that are simulated from where the arm was measured.

Over a segment errors of the model add up until they show, and errors of the state that
it began in fade (multiple shooting, Bock 1981, with the states as measured).
"""

import dataclasses
import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drake_disasm.logs import Episode
from drake_disasm.logs.importing.cutoff import chosen_cutoff, motion_spectra
from drake_disasm.logs.importing.signals import (
    even_times,
    longest_stretch,
    quantum,
    resample,
)
from sysid.models.base import Array
from sysid.models.response.drive import DriveSettings, Inputs

_LEAST_NOISE = 1e-6  # rad, or m: no encoder is better
#: Of a joint's travel; of two simulations of one arm none is nearer to the other.
_LEAST_SHARE = 1e-5
_INNER, _INNER_SHARE = 0.95, 0.87  # of normal noise: rms of those below a quantile
_LEAST_ROWS = 7  # of a local parabola


@dataclass(frozen=True)
class LocalFit:
    """Positions, velocities and accelerations by parabolas through nearby rows."""

    q: Array
    v: Array
    vd: Array


def local_fit(time: Array, q: Array, at: Array, reach: float) -> LocalFit:
    """Returns what parabolas through nearby rows give, (m, joints) each.

    Savitzky and Golay's filter (1964), for rows that need not be evenly spaced, and up
    to the ends of a record.

    Args:
        time: (n,) increasing [s].
        q: (n, joints) measured.
        at: (m,) when [s].
        reach: rows so near count [s]; there are seven at least.
    """
    found = np.empty((3, len(at), q.shape[1]))
    for i, t in enumerate(at):
        near = np.abs(time - t) <= reach
        if near.sum() < _LEAST_ROWS:
            near = np.argsort(np.abs(time - t), kind="stable")[:_LEAST_ROWS]
        s = time[near] - t
        A = np.stack([np.ones_like(s), s, 0.5 * s**2], axis=1)
        found[:, i] = np.linalg.lstsq(A, q[near], rcond=None)[0]
    return LocalFit(*found)


def reach_of(episodes: Sequence[Episode]) -> float:
    """Returns how far a local parabola may reach [s], by the motion's spectrum."""
    cutoffs = []
    for episode in episodes:
        longest = longest_stretch(episode["time"])
        time = episode["time"][longest]
        if len(time) > 2 * _LEAST_ROWS:
            even = even_times(time)
            q = resample(time, episode["q"][longest], even)
            period = float(even[1] - even[0])
            cutoffs.append(chosen_cutoff(motion_spectra([q], period), period))
    return 0.25 / max(cutoffs) if cutoffs else 0.0


def measured_noise(episodes: Sequence[Episode]) -> Array:
    """Returns the standard deviation (joints,) of measured positions.

    By how far each row is off the cubic through two on either side, which follows what
    a servo does also where rows are far apart; or by the encoder's step, if that is
    more. A simulated arm may have no encoder at all: then it is what the steps of time
    leave between it and any model.

    Args:
        episodes: of a log of kind `joint_response`.
    """
    off, steps, least = [], [], np.full(episodes[0]["q"].shape[1], _LEAST_NOISE)
    for episode in episodes:
        time, q = episode["time"], episode["q"]
        weights = _cubic_weights(time)
        neighbours = np.array([q[near] for near in _NEIGHBOURS])
        between = np.einsum("kn,knj->nj", weights, neighbours)
        scale = np.sqrt(1.0 + np.sum(weights**2, axis=0))[:, None]
        off.append((q[2:-2] - between) / scale)
        steps.append([quantum(column) for column in q.T])
        least = np.maximum(least, _LEAST_SHARE * np.ptp(q, axis=0))
    size = np.abs(np.concatenate(off))
    if not len(size):  # nothing but scraps
        return least
    most = np.quantile(size, _INNER, axis=0)
    inner = np.sum(size**2 * (size <= most), axis=0) / np.sum(size <= most, axis=0)
    scatter = np.sqrt(inner) / _INNER_SHARE
    rounding = np.max(steps, axis=0) / np.sqrt(12.0)
    return np.maximum(np.maximum(scatter, rounding), least)


#: Of each row but the first and last two, two on either side.
_NEIGHBOURS = (slice(0, -4), slice(1, -3), slice(3, -1), slice(4, None))


def _cubic_weights(time: Array) -> Array:
    """Returns the weights (4, n) of each row's neighbours in Lagrange's cubic there."""
    t = np.array([time[near] for near in _NEIGHBOURS])
    weights = np.ones_like(t)
    for i, j in itertools.permutations(range(4), 2):
        weights[i] *= (time[2:-2] - t[j]) / (t[i] - t[j])
    return weights


@dataclass(frozen=True)
class Segment:
    """A piece of an episode.

    Attributes:
        start: when it begins [s].
        q, v: (joints,) there.
        time: (n,) of the episode [s].
        inputs: of the drives in the episode, row by row (n, joints).
        vd: (joints,) accelerations there.
        measured: positions and velocities of the episode, row by row, (n, joints)
            each, which simulated ones should be near; None: not known.
        path: times (m,) [s] and smoothed positions (m, joints) of the episode, on which
            the joints came where the segment begins; None: not known.
    """

    start: float
    q: Array
    v: Array
    time: Array
    inputs: Inputs
    vd: Array
    measured: tuple[Array, Array] | None = None
    path: tuple[Array, Array] | None = None

    def inputs_at(self, times: Array, delay: float) -> Inputs:
        """Returns what goes into the drives at times (..., ), with a late goal.

        Goals, their rates and supplies are interpolated; gains and switches hold until
        the next row.

        Args:
            times: of the episode [s]; beyond its ends, what is there.
            delay: T, of the goal [s].
        """
        before = np.searchsorted(self.time, times, side="right") - 1
        before = np.clip(before, 0, len(self.time) - 1)
        return dataclasses.replace(
            self.inputs.at(before),
            goal=interpolated(self.time, self.inputs.goal, times - delay),
            rate=interpolated(self.time, self.inputs.rate, times - delay),
            supply=interpolated(self.time, self.inputs.supply, times),
        )

    def measured_at(self, times: Array) -> tuple[Array, Array] | None:
        """Returns positions and velocities (n, joints) at times (n,), if measured."""
        if self.measured is None:
            return None
        q, v = self.measured
        return interpolated(self.time, q, times), interpolated(self.time, v, times)


def interpolated(time: Array, values: Array, at: Array) -> Array:
    """Returns values (n, joints) at times (...), as (..., joints)."""
    return np.stack([np.interp(at, time, column) for column in values.T], axis=-1)


def inputs_of(episode: Episode, settings: DriveSettings) -> Inputs:
    """Returns what goes into the drives in an episode, row by row (n, joints).

    Args:
        episode: of a log of kind `joint_response`.
        settings: what is known of the drives.
    """
    goal = episode["q_commanded"]
    rate = np.zeros_like(goal)
    if settings.velocity_feedforward:
        rate = np.gradient(goal, episode["time"], axis=0)

    def or_ones(name: str) -> Array:
        """Returns a quantity, or ones if the log lacks it."""
        return episode[name] if name in episode else np.ones_like(goal)

    return Inputs(goal, rate, or_ones("gain"), or_ones("supply"), or_ones("enabled"))


def segments_of(
    episode: Episode, settings: DriveSettings, length: float, reach: float
) -> tuple[list[Segment], NDArray[np.int64]]:
    """Returns an episode's segments, and the number of each row's (n,).

    Args:
        episode, settings: see `inputs_of`.
        length: of a segment at least, the episode's if that is shorter [s].
        reach: see `local_fit`.
    """
    time = episode["time"]
    duration = float(time[-1] - time[0])
    count = max(1, int(duration / length))
    starts = time[0] + duration / count * np.arange(count)
    number = np.clip(np.searchsorted(starts, time, side="right") - 1, 0, None)
    state = local_fit(time, episode["q"], starts, reach)
    inputs = inputs_of(episode, settings)
    segments = [
        Segment(float(start), state.q[i], state.v[i], time, inputs, state.vd[i])
        for i, start in enumerate(starts)
    ]
    return segments, number
