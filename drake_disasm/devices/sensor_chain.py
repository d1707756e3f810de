"""The chain from the load on a force/torque sensor to its reading."""

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from drake_disasm.common.arrays import Array, namespace
from drake_disasm.common.spatial import weight_wrench
from drake_disasm.effects import Sensing, SensorEffect, SensorMemoryEffect

#: Samples of the sensor between two loads of a trajectory.
BETWEEN = 9

#: Reads a load (..., 6) through the i-th effect of a chain, which has a memory.
ReadMemory = Callable[[int, SensorMemoryEffect, Array], Array]


@dataclasses.dataclass(frozen=True)
class Payload:
    """What is known to hang on the sensor.

    Attributes:
        mass: [kg].
        p_SoScm_S: (3,) its centre of mass [m].
        g_W: gravity (3,) [m/s^2].
    """

    mass: float
    p_SoScm_S: Array
    g_W: Array

    def sensing(self, time: Array, R_WS: Array) -> Sensing:
        """Returns the circumstances of readings.

        Args:
            time: (...,) [s].
            R_WS: (..., 3, 3) orientations of the sensor.
        """
        return Sensing(time, R_WS, self.g_W, self.mass, self.p_SoScm_S)

    def weight(self, R_WS: Array) -> Array:
        """Returns its load on the sensor, (..., 6) [f; tau] at So in S.

        Args:
            R_WS: (..., 3, 3) orientations of the sensor.
        """
        return weight_wrench(self.mass, self.p_SoScm_S, R_WS, self.g_W)


def sensed(
    load: Array,
    effects: Sequence[SensorEffect],
    sensing: Sensing,
    read_memory: ReadMemory | None = None,
) -> Array:
    """Returns what a sensor with effects reads of loads, (..., 6) [f; tau] in S.

    Args:
        load: (..., 6) on the sensor.
        effects: in the order of the chain.
        sensing: of the loads.
        read_memory: reads a load through an effect with a memory; None for what is
            read after long rest.
    """
    for i, effect in enumerate(effects):
        sensing = effect.circumstances(sensing)
        if read_memory and isinstance(effect, SensorMemoryEffect):
            load = read_memory(i, effect, load)
        else:
            load = effect.apply(load, sensing)
    return load


def sensed_at_zeroing(
    load: Array, effects: Sequence[SensorEffect], sensing: Sensing
) -> Array:
    """Returns the reading (..., 6) that zeroing takes, of the load then (..., 6)."""
    return sensed(load, [e for e in effects if e.present_at_zeroing], sensing)


def sensed_sample(
    load: Array,
    effects: Sequence[SensorEffect],
    sensing: Sensing,
    memories: Array,
    interval: float,
) -> tuple[Array, Array]:
    """Returns what a sensor with memory reads, (..., 6), and remembers, (..., m).

    Args:
        load: (..., 6) [f; tau] in S.
        effects: in the order of the chain.
        sensing: of the loads.
        memories: (..., m) of the sample before, of one effect after the other, and
            maybe more; NaN where there was none.
        interval: since then [s].
    """
    xp = namespace(memories)
    memories = xp.asarray(memories, copy=True)

    def read(i: int, effect: SensorMemoryEffect, load: Array) -> Array:
        """Updates the effect's memory, and reads with it."""
        first, end = memory_size(effects[:i]), memory_size(effects[: i + 1])
        before = memories[..., first:end]
        before = xp.where(xp.isnan(before), effect.begin(load), before)
        now = effect.remember(before, load, interval)
        memories[..., first:end] = now
        return effect.read(load, now)

    return sensed(load, effects, sensing, read), memories


def memory_size(effects: Sequence[SensorEffect]) -> int:
    """Returns how many numbers effects remember together."""
    return sum(e.memory_size for e in effects if isinstance(e, SensorMemoryEffect))


def sensed_along(
    loads: Array,
    effects: Sequence[SensorEffect],
    sensing: Sensing,
    at_rest: Array,
    rest: Sensing,
    between: Array | None = None,
) -> Array:
    """Returns what a sensor reads of loads one after the other, (n, 6) [f; tau] in S.

    Args:
        loads: (n, 6).
        effects: in the order of the chain.
        sensing: of the loads; its times (n,) start anew in each episode.
        at_rest: (6,) the load before an episode begins.
        rest: the circumstances then.
        between: (n, BETWEEN, 6) by how much loads on the way from the one before,
            evenly in time, are off the straight line; nothing if left out.
    """
    between = np.zeros((len(loads), BETWEEN, 6)) if between is None else between

    def read(i: int, effect: SensorMemoryEffect, loads: Array) -> Array:
        """Reads all loads, from what reaches this effect at rest."""
        times = np.asarray(sensing.time)
        before = sensed(at_rest, effects[:i], rest)
        return _along(effect, loads, before, times, between)

    return sensed(loads, effects, sensing, read)


def _along(
    effect: SensorMemoryEffect,
    loads: Array,
    at_rest: Array,
    times: Array,
    between: Array,
) -> Array:
    """Returns what an effect with a memory reads of loads (n, 6), each in its turn.

    An episode begins at rest. Episodes are read side by side.
    """
    begins = np.flatnonzero(np.diff(times, prepend=np.inf) <= 0.0)
    lengths = np.diff(begins, append=len(times))
    episodes = [slice(b, b + n) for b, n in zip(begins, lengths, strict=True)]
    found_at_once = [
        effect.along(*_samples(loads[e], at_rest, times[e], between[e]))
        for e in episodes
    ]
    whole = [each for each in found_at_once if each is not None]
    if len(whole) == len(episodes):
        return np.concatenate([each[BETWEEN + 1 :: BETWEEN + 1] for each in whole])
    found, previous = np.empty_like(loads), np.tile(at_rest, (len(begins), 1))
    memory, before = effect.begin(previous).copy(), np.zeros(len(begins))
    for k in range(int(lengths.max(initial=0))):
        reading = np.flatnonzero(lengths > k)
        rows = begins[reading] + k
        intervals = times[rows] - before[reading]
        for interval in np.unique(intervals):
            own = intervals == interval
            e, row = reading[own], rows[own]
            memory[e] = _remembered(
                effect, memory[e], previous[e], loads[row], between[row], interval
            )
            found[row] = effect.read(loads[row], memory[e])
        previous[reading], before[reading] = loads[rows], times[rows]
    return found


def _samples(
    loads: Array, at_rest: Array, times: Array, between: Array
) -> tuple[Array, Array]:
    """Returns all loads of an episode, those in between included, and their times.

    The first is that at rest.

    Args:
        loads: (n, 6).
        at_rest: (6,) before them, at time zero.
        times: (n,) [s].
        between: (n, BETWEEN, 6) by how much loads are off the straight line.
    """
    share = np.arange(1, BETWEEN + 2) / (BETWEEN + 1)
    before, since = np.vstack([at_rest, loads[:-1]]), np.diff(times, prepend=0.0)
    all_loads = before[:, None] + share[:, None] * (loads - before)[:, None]
    all_loads[:, :-1] += between
    all_times = times[:, None] - since[:, None] * (1.0 - share)
    return (
        np.vstack([at_rest, all_loads.reshape(-1, 6)]),
        np.concatenate([np.zeros(1), all_times.ravel()]),
    )


def _remembered(
    effect: SensorMemoryEffect,
    memory: Array,
    before: Array,
    now: Array,
    between: Array,
    interval: float,
) -> Array:
    """Returns what an effect remembers (e, m) after a while with loads in between.

    Args:
        effect: with a memory.
        memory: (e, m).
        before, now: (e, 6) loads at the begin and at the end of the while.
        between: (e, BETWEEN, 6) by how much loads are off the line from one to other.
        interval: its length [s].
    """
    count = BETWEEN + 1
    off = np.concatenate([between, np.zeros((len(now), 1, 6))], axis=1)
    for k in range(count):
        load = before + (k + 1) / count * (now - before) + off[:, k]
        memory = effect.remember(memory, load, interval / count)
    return memory
