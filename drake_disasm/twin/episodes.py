"""The episodes of a batch: all that changes from step to step, and how they begin."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from drake_disasm.common.arrays import Array, array_like
from drake_disasm.common.rotations import Pose
from drake_disasm.devices.sensor_chain import (
    memory_size,
    sensed_at_zeroing,
    sensed_sample,
)
from drake_disasm.effects import BoltMotion, MotionEffect
from drake_disasm.scenario import Scenario, with_values
from drake_disasm.twin.numbers import TwinNumbers
from drake_disasm.twin.plant import Plant, PlantState
from drake_disasm.twin.scalar_effects import refuse_scalar_effects
from drake_disasm.twin.slots import EffectSlots
from drake_disasm.twin.stacking import leaves_of, shared, with_leaves
from drake_disasm.twin.twins import Twins, at_A


@dataclasses.dataclass
class Episodes:
    """The running episodes of n environments; rows of arrays are environments.

    Attributes:
        numbers: (n, ...) of each twin, those in which the twins differ.
        effects: (n, m) numbers of the effects (`EffectSlots`).
        state: of the plant.
        goal: (n, 6) coordinates to which the command has led.
        commanded: pose of the bolt, before effects on the motion.
        offset: (n, 6) of the sensor, as zeroed.
        reading: (n, 6) of the sensor, without noise.
        motion_memory, sensor_memory: (n, k, 6), (n, m) of the effects.
        steps: (n,) of the MDP since the episodes began.
    """

    numbers: tuple[Array, ...]
    effects: Array
    state: PlantState
    goal: Array
    commanded: Pose
    offset: Array
    reading: Array
    motion_memory: Array
    sensor_memory: Array
    steps: Array


@dataclasses.dataclass(frozen=True)
class _Samples:
    """What the sensor has read in a period, of n environments.

    Attributes:
        state: of the plant at its end.
        reading, memory: (n, 6), (n, m) then.
        is_solved: (n,) whether contact always found a balance.
    """

    state: PlantState
    reading: Array
    memory: Array
    is_solved: Array


class TwinBatch:
    """The equations of a batch: what its environments have in common.

    Args:
        scenarios: one for each environment, with their ranges.
        like: an empty array of the kind that computes.
        threads: of the host, which share the environments.

    Raises:
        DisasmError: the equation of a user's own effect takes no arrays.
    """

    def __init__(
        self, scenarios: Sequence[Scenario], like: Array, threads: int = 1
    ) -> None:
        self.like, self.slots, self._threads = like, EffectSlots(scenarios), threads
        refuse_scalar_effects(self.slots.slots, like)
        first = scenarios[0]
        self.period = first.task.period
        self.h = first.simulation.twin_time_step
        self._per_sample = max(1, round(first.ft_sensor.period / self.h))
        self._is_exact = first.observation.variant == "exact"
        self._template = shared(TwinNumbers.of(first), like)
        self._varying = _varying_leaves(scenarios)

    def twins(self, episodes: Episodes) -> Twins:
        """Returns the environments' twins."""
        leaves = dict(zip(self._varying, episodes.numbers, strict=True))
        numbers = _in_columns(with_leaves(self._template, leaves))
        effects, start = self.slots.effects(episodes.effects), at_A(episodes.goal)
        return Twins(numbers, effects, self._is_exact, start, self._threads)

    def begin(self, which: Sequence[int], scenarios: Sequence[Scenario]) -> Episodes:
        """Returns episodes that have settled at A, zeroed and made their first step.

        Args:
            which: the environments' numbers.
            scenarios: theirs, with ranges drawn.
        """
        episodes = self.at_rest(which, scenarios)
        twins, still = self.twins(episodes), 0.0 * episodes.goal
        step = twins.plant_at_A.settled(episodes.state)
        load = twins.load_S(step.state.arm, step)
        sensing = twins.sensing(step.state.arm, episodes.steps)
        reading = sensed_at_zeroing(load, twins.effects.sensor, sensing)
        episodes.offset = twins.processing.offset(reading)
        episodes.state = dataclasses.replace(step.state, v=still)
        samples = self._period(episodes, still, twins, twins.plant_at_A, steps=1)
        episodes.state, episodes.reading = samples.state, samples.reading
        episodes.sensor_memory = samples.memory
        return episodes

    def advance(self, episodes: Episodes, twins: Twins, goal: Array, v: Array) -> Array:
        """Moves the command to other coordinates in one period.

        Args:
            episodes: changed in place, but for their steps.
            twins: theirs.
            goal: (n, 6) coordinates.
            v: (n, 3) the bolt's commanded velocity in Gn [m/s].

        Returns:
            Whether the contact of each always found a balance (n,).
        """
        X_GB = twins.numbers.coordinates.poses(episodes.state.q)
        plant = twins.plant(BoltMotion(X_GB.p, v, episodes.steps * self.period))
        rate = (goal - episodes.goal) / self.period
        steps = round(self.period / self.h)
        samples = self._period(episodes, rate, twins, plant, steps)
        episodes.state, episodes.goal = samples.state, goal
        episodes.reading, episodes.sensor_memory = samples.reading, samples.memory
        return samples.is_solved

    def at_rest(self, which: Sequence[int], scenarios: Sequence[Scenario]) -> Episodes:
        """Returns episodes at A, before the bolt has settled; see `begin`."""
        like, count = self.like, len(scenarios)
        leaves = [leaves_of(TwinNumbers.of(s)) for s in scenarios if self._varying]
        own = tuple(
            array_like(np.stack([leaf[i] for leaf in leaves]), like)
            for i in self._varying
        )
        rows = [
            self.slots.row(i, s.effects) for i, s in zip(which, scenarios, strict=True)
        ]

        def zeros(*shape: int) -> Array:
            """Returns an array of its own."""
            return array_like(np.zeros((count, *shape)), like)

        episodes = Episodes(
            numbers=own,
            effects=array_like(np.reshape(rows, (count, -1)), like),
            state=PlantState(zeros(12), zeros(6), zeros(6), zeros(6)),
            goal=zeros(6),
            commanded=Pose(zeros(3, 3) + array_like(np.eye(3), like), zeros(3)),
            offset=zeros(6),
            reading=zeros(6),
            motion_memory=zeros(self.slots.count(MotionEffect), 6),
            sensor_memory=zeros(0),
            steps=zeros(),
        )
        size = memory_size(self.slots.effects(episodes.effects).sensor)
        episodes.sensor_memory = array_like(np.full((count, size), np.nan), like)
        return episodes

    def _period(
        self,
        episodes: Episodes,
        rate: Array,
        twins: Twins,
        plant: Plant,
        steps: int,
    ) -> _Samples:
        """Returns what becomes of the episodes in some steps of the plant.

        In one go, unless the sensor's memory takes a sample in between.
        """
        sensor, state = twins.effects.sensor, episodes.state
        memory, is_solved = episodes.sensor_memory, True
        is_first = steps == 1  # of an episode, before which nothing has moved
        begin, done = episodes.steps * self.period, 0
        h = 0.0 if is_first else self.h
        while done < steps:
            size = min(self._per_sample, steps - done) if memory.shape[1] else steps
            step = plant.advance(state, rate, size)
            state, is_solved, done = step.state, is_solved & step.is_solved, done + size
            if memory.shape[1] and (is_first or done % self._per_sample == 0):
                sensing = twins.sensing(step.arm_before, begin + done * h)
                load = twins.load_S(step.arm_before, step)
                _, memory = sensed_sample(
                    load, sensor, sensing, memory, h * self._per_sample
                )
        sensing = twins.sensing(state.arm, begin + steps * h)
        load = twins.load_S(state.arm, step)
        reading, _ = sensed_sample(load, sensor, sensing, memory, 0.0)
        return _Samples(state, reading, memory, is_solved)


def _varying_leaves(scenarios: Sequence[Scenario]) -> list[int]:
    """Returns which of the twins' numbers differ, between or within environments."""
    ends = []
    for scenario in {repr(s): s for s in scenarios}.values():
        for share in (0.0, 0.37, 1.0) if scenario.randomisation else (0.0,):
            values = {
                r.parameter: r.low + share * (r.high - r.low)
                for r in scenario.randomisation
            }
            ends.append(leaves_of(TwinNumbers.of(with_values(scenario, values))))
    return [
        i
        for i, first in enumerate(ends[0])
        if any(not np.array_equal(first, leaves[i]) for leaves in ends[1:])
    ]


def _in_columns(numbers: TwinNumbers) -> TwinNumbers:
    """Returns numbers with those of n twins that scale vectors as columns."""
    body, mounting = numbers.body, numbers.mounting
    return dataclasses.replace(
        numbers,
        body=dataclasses.replace(body, mass=_column(body.mass)),
        mounting=dataclasses.replace(mounting, mass=_column(mounting.mass)),
    )


def _column(mass: float | Array) -> float | Array:
    return mass if isinstance(mass, float) else mass[:, None]
