"""Simulated logs of transitions with undeclared effects.

Episodes run in parallel: each period is one batch of the replay that steps the twin
with IMPACT (`ImpactReplay`), so that a log of hundreds of steps takes a second. Tests
compare it with the diagram.
"""

import copy
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from drake_disasm.cell.tool import Tool
from drake_disasm.effects import (
    Effect,
    EnvironmentEffect,
    SensorEffect,
    SensorMemoryEffect,
    motion_chain,
    pose_weights,
    reported_poses,
    sensor_chain,
)
from drake_disasm.logs import LogWriter, flat_columns
from drake_disasm.scenario import Scenario
from drake_disasm.systems.pose_target import through_motion
from drake_disasm.task.recording import transitions_header
from drake_disasm.twin.replay import ImpactReplay
from drake_disasm.twin.steps import Steps
from sysid.models.arm_rates import ArmRates
from sysid.models.base import Array
from sysid.models.commands import twin_coordinates
from sysid.models.grip_state import GripState
from sysid.models.sensor_reading import SensorReading, at_bolt, at_sensor

_FORWARD, _BACK = 2.2e-3, -1.2e-3  # m per step, on average
_ACROSS, _TURN = 1.6e-4, 6e-3  # m, rad: standard deviation of commands
_FORGETS = 0.6  # share of a command's deviation that is left after a step


@dataclass(frozen=True)
class Rollout:
    """What E parallel episodes of n steps measured.

    Attributes:
        commanded: (E, n + 1, 6) position and rotation vector of B in G.
        states: (E, n + 1, 12) measured, the wrench at So in S.
        readings: (E, n + 1, 6) of the sensor, raw, in S.
    """

    commanded: Array
    states: Array
    readings: Array


def transitions_log(
    folder: Path,
    scenario: Scenario,
    effects: Sequence[Effect],
    seed: int,
    episodes: int = 12,
    steps: int = 25,
    correlation: float = 0.0,
) -> None:
    """Writes a log that states a scenario and was recorded with more effects.

    Args:
        folder: of the log.
        scenario: with IMPACT contact.
        effects: that the log does not declare.
        seed: of commands and noise.
        episodes, steps: number of episodes, and steps of each.
        correlation: of the noise from one step to the next.
    """
    random = np.random.default_rng(seed)
    commanded = commands(random, episodes, steps)
    noise = sensor_noise(scenario, random, episodes, steps, correlation)
    found = rollout(scenario, effects, commanded, noise)
    header = transitions_header(scenario, "twin", {"policy": "strokes"})
    with LogWriter(folder, header) as writer:
        rows = zip(found.commanded, found.states, found.readings, strict=True)
        for path, states, readings in rows:
            columns = _columns(scenario, path, states) | {"ft_sensor": readings}
            writer.write_episode(flat_columns("transitions", columns))


def commands(random: np.random.Generator, episodes: int, steps: int) -> Array:
    """Returns commanded displacements (E, n + 1, 6): strokes forth and back.

    Several speeds, both directions, pressing to all sides: so that effects differ.
    """
    stroke = np.zeros((episodes, steps))
    for e in range(episodes):
        k = 0
        while k < steps:
            length = int(random.integers(3, 8))
            mean = _FORWARD if random.random() < 0.75 else _BACK
            stroke[e, k : k + length] = mean * random.uniform(0.2, 1.8)
            k += length
    path: Array = np.zeros((episodes, steps + 1, 6))
    travel = np.cumsum(stroke, axis=1)
    path[:, 1:, 0] = np.clip(travel, 0.0, 0.05)
    spread = np.array([_ACROSS] * 2 + [_TURN] * 3) * np.sqrt(1.0 - _FORGETS**2)
    for k in range(steps):
        pushed = spread * random.standard_normal((episodes, 5))
        path[:, k + 1, 1:] = _FORGETS * path[:, k, 1:] + pushed
    return path


def sensor_noise(
    scenario: Scenario,
    random: np.random.Generator,
    episodes: int,
    steps: int,
    correlation: float = 0.0,
) -> Array:
    """Returns noise of the sensor's channels (E, n + 1, 6), correlated over steps."""
    white = random.standard_normal((episodes, steps + 1, 6))
    noise: Array = np.array(white)
    for k in range(1, steps + 1):
        fresh = np.sqrt(1.0 - correlation**2) * white[:, k]
        noise[:, k] = correlation * noise[:, k - 1] + fresh
    noise *= np.array(scenario.ft_sensor.noise)
    return noise


def rollout(
    scenario: Scenario, effects: Sequence[Effect], commanded: Array, noise: Array
) -> Rollout:
    """Returns what a twin with effects measures while it is commanded.

    Args:
        scenario: with IMPACT contact.
        effects: in addition to the scenario's.
        commanded: (E, n + 1, 6), from rest at A.
        noise: (E, n + 1, 6) of the sensor.
    """
    real = copy.deepcopy(scenario)
    real.effects = [*real.effects, *effects]
    motion, sensor = motion_chain(real.effects), sensor_chain(real.effects)
    weights = pose_weights(real.effects, scenario.task.period)
    real.effects = [e for e in real.effects if isinstance(e, EnvironmentEffect)]
    replay = ImpactReplay([real])
    reading = SensorReading(scenario, Tool.from_models(scenario))
    measured = _Measured(scenario, commanded)
    count, size, _ = commanded.shape
    # A step begins under the load as the model knows it, see `MeasuredEpisode.steps`.
    is_undone = not any(isinstance(e, SensorMemoryEffect) for e in sensor)
    noise_of_states = np.concatenate([np.zeros_like(noise), noise], axis=2)
    clean, states = np.zeros_like(noise_of_states), noise_of_states.copy()
    executed = np.array(commanded)
    memories = np.zeros((count, len(motion), 6))
    times = np.arange(1, size, dtype=np.float64) * scenario.task.period
    [zero] = replay.reading_at_zeroing
    states[:, 0] += _last_read(reading, sensor, clean[:, :1], zero, np.zeros(1))
    for k in range(size - 1):
        in_G = at_bolt(states[:, k], reading.mounting)
        for e in range(count):
            executed[e, k + 1], memories[e] = through_motion(
                motion, commanded[e, k + 1], in_G[e, 6:], memories[e], times[0]
            )
        if is_undone:
            in_G = at_bolt(clean[:, k] + noise_of_states[:, k], reading.mounting)
        step = measured.steps(k, in_G, executed[:, k : k + 2])
        [after] = replay.transitions([step])
        clean[:, k + 1] = at_sensor(after, reading.mounting)
        so_far = clean[:, 1 : k + 2]
        states[:, k + 1] += _last_read(reading, sensor, so_far, zero, times[: k + 1])
    readings = np.array([reading.raw(s, zero) for s in states])
    return Rollout(commanded, _reported(states, weights, reading), readings)


def _last_read(
    reading: SensorReading,
    sensor: Sequence[SensorEffect],
    states: Array,
    zero: Array,
    times: Array,
) -> Array:
    """Returns how the last states (E, 12) of episodes so far (E, k, 12) are read."""
    return np.array([reading.read(sensor, own, zero, times)[-1] for own in states])


def _reported(states: Array, weights: Array, reading: SensorReading) -> Array:
    """Returns states (E, n + 1, 12) with the poses that come in, see `pose_weights`."""
    if len(weights) <= 1:
        return states
    seen = [reported_poses(path, weights) for path in states[:, :, :6]]
    pairs = zip(states, seen, strict=True)
    return np.array([reading.reported(s, poses) for s, poses in pairs])


class _Measured:
    """What a log's model knows at the begin of a step, of all episodes.

    Args:
        scenario: that the log states.
        commanded: (E, n + 1, 6).
    """

    def __init__(self, scenario: Scenario, commanded: Array) -> None:
        self._rates, self._grip = ArmRates.of(scenario), GripState.of(scenario)
        self._p_BoTo_B = Tool.from_models(scenario).p_BoTo_B
        self._q, self._wrench = np.zeros((2, *commanded.shape))
        self._v, self._elastic = np.zeros((2, len(commanded), 6))
        self._went = np.zeros((len(commanded), 2, 6))

    def steps(self, k: int, states: Array, executed: Array) -> Steps:
        """Returns step k of all episodes; steps are asked for in their order.

        Args:
            k: number of the step.
            states: (E, 12) at its begin, the wrench at Bo in G.
            executed: (E, 2, 6) commands at begin and end.
        """
        self._q[:, k] = self._coordinates(states[:, :6])
        self._wrench[:, k] = states[:, 6:]
        if not k:
            self._elastic = np.array(states[:, 6:])
        else:
            last = np.s_[:, k - 1 : k + 1]
            self._elastic = self._grip.after(self._elastic, self._wrench[last])
            self._v = self._rates.after(
                self._v, self._q[last], self._went, self._wrench[last]
            )
        qd = self._went = self._coordinates(executed)
        rate = (qd[:, 1] - qd[:, 0]) / self._rates.step.h
        give_rate = self._grip.rates(self._elastic, self._wrench[:, k])
        return Steps(
            np.full(len(qd), k),
            self._q[:, k],
            self._v,
            qd[:, 0],
            rate,
            self._elastic,
            give_rate,
        )

    def _coordinates(self, path: Array) -> Array:
        """Returns the twin's coordinates (..., 6) of a path (..., 6)."""
        flat = twin_coordinates(path.reshape(-1, 6), self._p_BoTo_B)
        return flat.reshape(path.shape)


def _columns(scenario: Scenario, path: Array, states: Array) -> dict[str, Array]:
    """Returns the columns of an episode's log."""
    mounting = SensorReading(scenario, Tool.from_models(scenario)).mounting
    actions = np.zeros_like(path)
    turn = Rotation.from_rotvec(path[:, 3:])
    actions[:-1, :3] = np.diff(path[:, :3], axis=0)
    actions[:-1, 3:] = (turn[1:] * turn[:-1].inv()).as_rotvec()
    rows = len(path)
    last = np.arange(rows) == rows - 1
    return {
        "time": np.arange(rows) * scenario.task.period,
        "X_GB_measured": _poses(states[:, :6]),
        "X_GB_commanded": _poses(path),
        "wrench": at_bolt(states, mounting)[:, 6:],
        "action": actions,
        "terminated": np.zeros(rows, dtype=bool),
        "truncated": last,
    }


def _poses(path: Array) -> Array:
    """Returns poses (n, 7) of positions and rotation vectors (n, 6)."""
    quaternion = Rotation.from_rotvec(path[:, 3:]).as_quat()[:, [3, 0, 1, 2]]
    return np.hstack([path[:, :3], quaternion])
