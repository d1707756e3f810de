"""The episodes of a batch: all that changes from step to step, and how they begin."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from drake_disasm.batch.motion import PlantStep, TwinState, plant_step
from drake_disasm.batch.numbers import TwinNumbers
from drake_disasm.batch.slots import BatchEffects, EffectSlots
from drake_disasm.batch.stacking import leaves_of, shared, with_leaves
from drake_disasm.common.arrays import Array, array_like, namespace
from drake_disasm.common.rotations import Pose
from drake_disasm.common.spatial import shifted_wrench
from drake_disasm.devices.sensor_chain import (
    memory_size,
    sensed_at_zeroing,
    sensed_sample,
)
from drake_disasm.effects import (
    BoltMotion,
    Environment,
    MotionEffect,
    Sensing,
    environment_at,
)
from drake_disasm.impact import ImpactConditions, Surroundings
from drake_disasm.scenario import Scenario, with_values
from drake_disasm.stations.twin import TwinStation
from drake_disasm.systems.observation import Processing


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
    state: TwinState
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

    state: TwinState
    reading: Array
    memory: Array
    is_solved: Array


class TwinBatch:
    """The equations of a batch: what its environments have in common.

    Args:
        scenarios: one for each environment, with their ranges.
        like: an empty array of the kind that computes.
    """

    def __init__(self, scenarios: Sequence[Scenario], like: Array) -> None:
        self.like, self.slots = like, EffectSlots(scenarios)
        first = scenarios[0]
        self.period = first.task.period
        self.h = first.simulation.twin_time_step
        self._per_sample = max(1, round(first.ft_sensor.period / self.h))
        self._is_exact = first.observation.variant == "exact"
        self._template = shared(TwinNumbers.of(first), like)
        self._varying = _varying_leaves(scenarios)

    def numbers(self, episodes: Episodes) -> TwinNumbers:
        """Returns the numbers of the environments' twins."""
        leaves = dict(zip(self._varying, episodes.numbers, strict=True))
        return _in_columns(with_leaves(self._template, leaves))

    def effects(self, episodes: Episodes) -> BatchEffects:
        """Returns the effects of the environments."""
        return self.slots.effects(episodes.effects)

    def processing(self, episodes: Episodes) -> Processing:
        """Returns the processing of the environments' readings."""
        return Processing(self.numbers(episodes).mounting, self._is_exact)

    def begin(self, which: Sequence[int], scenarios: Sequence[Scenario]) -> Episodes:
        """Returns episodes that have settled at A, zeroed and made their first step.

        Args:
            which: the environments' numbers.
            scenarios: theirs, with ranges drawn.
        """
        episodes = self._at_rest(which, scenarios)
        effects = self.effects(episodes)
        conditions = self.conditions(episodes, effects, None)
        numbers = self.numbers(episodes)
        still = 0.0 * episodes.goal
        for _ in range(round(TwinStation.settling_time / self.h)):
            step = plant_step(
                episodes.state, still, numbers.arm, numbers.body, conditions
            )
            episodes.state = step.state
        load = self._load_S(numbers, step.state.arm, step)
        sensing = self._sensing(numbers, step.state.arm, episodes.steps)
        reading = sensed_at_zeroing(load, effects.sensor, sensing)
        episodes.offset = self.processing(episodes).offset(reading)
        episodes.state = dataclasses.replace(step.state, v=still)
        samples = self._period(episodes, still, effects, conditions, steps=1)
        episodes.state, episodes.reading = samples.state, samples.reading
        episodes.sensor_memory = samples.memory
        return episodes

    def advance(self, episodes: Episodes, goal: Array, v: Array) -> Array:
        """Moves the command to other coordinates in one period.

        Args:
            episodes: changed in place, but for their steps.
            goal: (n, 6) coordinates.
            v: (n, 3) the bolt's commanded velocity in Gn [m/s].

        Returns:
            Whether the contact of each always found a balance (n,).
        """
        effects = self.effects(episodes)
        motion = None
        if effects.is_local:
            X_GB = self.numbers(episodes).coordinates.poses(episodes.state.q)
            motion = BoltMotion(X_GB.p, v)
        conditions = self.conditions(episodes, effects, motion)
        rate = (goal - episodes.goal) / self.period
        steps = round(self.period / self.h)
        samples = self._period(episodes, rate, effects, conditions, steps)
        episodes.state, episodes.goal = samples.state, goal
        episodes.reading, episodes.sensor_memory = samples.reading, samples.memory
        return samples.is_solved

    def conditions(
        self, episodes: Episodes, effects: BatchEffects, bolt: BoltMotion | None
    ) -> ImpactConditions:
        """Returns the contact's conditions in the environments.

        Args:
            episodes: that run.
            effects: theirs.
            bolt: its motions, on which effects may depend; None is at rest at A.
        """
        numbers = self.numbers(episodes)
        nothing = 0.0 * episodes.goal[:, :3]
        motion = BoltMotion(nothing, nothing) if bolt is None else bolt
        environment = environment_at(numbers.nominal, effects.environment, motion)
        around = self._around(environment, len(nothing))
        return numbers.conditions(environment, around)

    def _at_rest(self, which: Sequence[int], scenarios: Sequence[Scenario]) -> Episodes:
        """Returns episodes at A, before the bolt has settled."""
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
            state=TwinState(zeros(12), zeros(6), zeros(6), zeros(6)),
            goal=zeros(6),
            commanded=Pose(zeros(3, 3) + array_like(np.eye(3), like), zeros(3)),
            offset=zeros(6),
            reading=zeros(6),
            motion_memory=zeros(self.slots.count(MotionEffect), 6),
            sensor_memory=zeros(0),
            steps=zeros(),
        )
        size = memory_size(self.effects(episodes).sensor)
        episodes.sensor_memory = array_like(np.full((count, size), np.nan), like)
        return episodes

    def _period(
        self,
        episodes: Episodes,
        rate: Array,
        effects: BatchEffects,
        conditions: ImpactConditions,
        steps: int,
    ) -> _Samples:
        """Returns what becomes of the episodes in some steps of the plant."""
        numbers = self.numbers(episodes)
        state, memory, is_solved = episodes.state, episodes.sensor_memory, True
        is_first = steps == 1  # of an episode, before which nothing has moved
        interval = 0.0 if is_first else self.h * self._per_sample
        begin = episodes.steps * self.period
        for number in range(1, steps + 1):
            encoders, time = state.arm, begin + (0.0 if is_first else number * self.h)
            step = plant_step(state, rate, numbers.arm, numbers.body, conditions)
            state, is_solved = step.state, is_solved & step.is_solved
            is_sample = is_first or number % self._per_sample == 0
            if memory.shape[1] and is_sample:
                sensing = self._sensing(numbers, encoders, time)
                load = self._load_S(numbers, encoders, step)
                _, memory = sensed_sample(
                    load, effects.sensor, sensing, memory, interval
                )
        sensing = self._sensing(numbers, state.arm, time)
        load = self._load_S(numbers, state.arm, step)
        reading, _ = sensed_sample(load, effects.sensor, sensing, memory, 0.0)
        return _Samples(state, reading, memory, is_solved)

    def _load_S(self, numbers: TwinNumbers, arm: Array, step: PlantStep) -> Array:
        """Returns the load on the sensor (n, 6), [f; tau] at So in S.

        Args:
            numbers: of the twins.
            arm: (n, 12) where encoders have the sensor.
            step: of the plant.
        """
        coordinates = numbers.coordinates
        X_GB, bolt = coordinates.poses(arm[:, :6]), coordinates.poses(step.state.q)
        X_SGn = numbers.mounting.X_SB @ X_GB.inverse()
        return shifted_wrench(step.load(numbers.body), X_SGn.R, X_SGn @ bolt.p)

    def _sensing(self, numbers: TwinNumbers, arm: Array, time: Array) -> Sensing:
        """Returns the circumstances of readings; see `_load_S`."""
        R_GB = numbers.coordinates.poses(arm[:, :6]).R
        R_GS = namespace(R_GB).matmul(R_GB, numbers.mounting.X_BS.R)
        return numbers.payload.sensing(time, numbers.mounting.R_WS(R_GS))

    def _around(self, environment: Environment, count: int) -> Surroundings:
        """Returns what may differ from environment to environment, (count, ...)."""
        xp, like, X_GnG = namespace(self.like), self.like, environment.X_GnG
        f_Gn = [
            xp.broadcast_to(array_like(f, like), (count,)) for f in environment.force_Gn
        ]
        return Surroundings(
            xp.broadcast_to(array_like(environment.friction, like), (count,)),
            xp.broadcast_to(X_GnG.rotation(), (count, 3, 3)),
            xp.broadcast_to(X_GnG.translation(), (count, 3)),
            xp.stack(f_Gn, axis=1),
        )


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
    replace, mass = dataclasses.replace, numbers.body.mass
    if isinstance(mass, float):
        return numbers
    return replace(
        numbers,
        body=replace(numbers.body, mass=mass[:, None]),
        mounting=replace(numbers.mounting, mass=mass[:, None]),
    )
