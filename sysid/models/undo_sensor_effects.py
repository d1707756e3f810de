"""Wrenches as they were before effects on the sensor, of those that were read."""

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from drake_disasm.effects import SensorEffect
from sysid.models.base import Array
from sysid.models.measured_episode import MeasuredEpisode
from sysid.models.sensor_reading import SensorReading, at_bolt

_PASSES = 4  # where effects are affine one is enough
_UNDONE = 1e-8  # N, N m: below what any sensor resolves
_CHANGE = 1e-4  # N, N m: of wrenches, for differences
_DAMPING = 1e-3  # of steps where a reading hardly shows a wrench: in a dead band


def undo_sensor_effects(
    episodes: Sequence[MeasuredEpisode],
    effects: Sequence[SensorEffect],
    sensing: SensorReading,
    p_BoTo_B: Array,
) -> list[MeasuredEpisode]:
    """Returns episodes with the wrench as it was before effects on the sensor.

    Args:
        episodes: as they were recorded.
        effects: without a memory, in the chain's order.
        sensing: of the scenario.
        p_BoTo_B: (3,) of the twin's coordinates [m].
    """
    if not effects:
        return list(episodes)
    states = [each.at_sensor(sensing, p_BoTo_B) for each in episodes]
    read = np.concatenate(states)
    times = np.concatenate([np.arange(len(own), dtype=np.float64) for own in states])
    times *= episodes[0].grip.period

    def reading(wrench: Array) -> Array:
        """Returns how wrenches (k, n, 6) at So in S are read."""
        count = len(wrench)
        poses = np.tile(read[:, :6], (count, 1))
        tried = np.hstack([poses, wrench.reshape(-1, 6)])
        found = sensing.read(effects, tried, sensing.at_rest, np.tile(times, count))
        return found[:, 6:].reshape(wrench.shape)

    found = np.hstack([read[:, :6], undone(reading, read[:, 6:])])
    wrench = at_bolt(found, sensing.mounting)[:, 6:]
    parts = np.split(wrench, np.cumsum([len(own) for own in states])[:-1])
    return [
        dataclasses.replace(episode, wrench=part)
        for episode, part in zip(episodes, parts, strict=True)
    ]


def undone(reading: Callable[[Array], Array], read: Array) -> Array:
    """Returns the wrenches (n, 6) that are read as these, or as nearly as can be.

    By Newton's method, row by row: gains that drift may more than double a reading.
    What a reading does not show, since a channel is saturated or within its dead band,
    is left as it is read.

    Args:
        reading: of wrenches (k, n, 6), what is read of each.
        read: (n, 6).
    """
    found, steps = read.copy(), _CHANGE * np.eye(6)[:, None]
    for _ in range(_PASSES):
        missing = read - reading(found[None])[0]
        if np.all(np.abs(missing) < _UNDONE):
            break
        ahead, behind = reading(found + steps), reading(found - steps)
        J_T = (ahead - behind).transpose(1, 0, 2) / (2 * _CHANGE)
        normal = J_T @ J_T.transpose(0, 2, 1) + _DAMPING * np.eye(6)
        found += np.linalg.solve(normal, J_T @ missing[..., None])[..., 0]
    return found
