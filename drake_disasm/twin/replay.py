"""The twin with IMPACT, many steps of the task of many twins at once.

Without the hydroelastic query a step of this twin is a small system of equations
(`ImpactStep`); for all measured steps together, and for all parameter sets of which a
search asks at once, it is a few array operations, and one evaluation of the objective
takes a fraction of the diagram's time (docs/results/identification.md has the figures).
"""

import dataclasses
import itertools
from collections.abc import Sequence
from typing import Self

import numpy as np

from drake_disasm.common.rotations import rotation_vectors
from drake_disasm.devices.sensor_chain import sensed, sensed_at_zeroing
from drake_disasm.scenario import Scenario, validate
from drake_disasm.twin.episodes import Episodes, TwinBatch
from drake_disasm.twin.numbers import TwinNumbers
from drake_disasm.twin.plant import PlantState, PlantStep
from drake_disasm.twin.stacking import rows_of
from drake_disasm.twin.steps import Ends, Steps, bolt_motion, noise_free
from drake_disasm.twin.twins import Twins

_COARSE = 0.01  # s: with 20 ms, steps under friction ended twice as far off


class ImpactReplay:
    """Computes `TwinReplay.transitions` of scenarios with IMPACT contact, faster.

    The diagram is the reference; the equations are those of the batched twin. What one
    scenario gives does not depend on the others.

    Attributes:
        reading_at_zeroing: (k, 6) what each sensor read when it was zeroed, [f; tau]
            in S; NaN where contact finds no balance at A.

    Args:
        scenarios: what the k twins are, `contact.model` being impact.
        coarse: whether the middle of a step may be simulated in coarse steps.

    Raises:
        DisasmError: a scenario is out of bounds.
    """

    def __init__(self, scenarios: Sequence[Scenario], coarse: bool = False) -> None:
        for scenario in scenarios:
            validate(scenario)
        self.reading_at_zeroing = np.zeros((len(scenarios), 6))
        self._parts: list[tuple[np.ndarray, _EvenReplay]] = []
        steps = np.array([_coarse_step(scenario) for scenario in scenarios])
        for h in np.unique(steps):
            which = np.flatnonzero(steps == h)
            group = [noise_free(scenarios[int(i)]) for i in which]
            replay = _EvenReplay(group, float(h), coarse)
            self._parts.append((which, replay))
            self.reading_at_zeroing[which] = replay.reading_at_zeroing

    def transitions(self, steps: Sequence[Steps]) -> list[np.ndarray]:
        """Returns the states (n, 12) after independent steps, each from its own start.

        NaN where contact finds no balance.

        Args:
            steps: n of each of the k twins; n may differ from one to the next.
        """
        return [ends.states for ends in self.ends(steps)]

    def ends(self, steps: Sequence[Steps]) -> list[Ends]:
        """Returns where independent steps lead, each from its own start.

        NaN where contact finds no balance.

        Args:
            steps: of each of the k twins; see `transitions`.
        """
        nothing = Ends(np.zeros((0, 12)), np.zeros((0, 6)))
        found = [nothing] * len(steps)
        for which, replay in self._parts:
            ends = replay.ends([steps[i] for i in which])
            for i, own in zip(which, ends, strict=True):
                found[i] = own
        return found


class _EvenReplay:
    """The replay of scenarios that allow for the same coarse time step.

    Args:
        scenarios: of the k twins.
        coarse_step: [s]; 0 if there is none.
        coarse: see `ImpactReplay`.
    """

    def __init__(
        self, scenarios: Sequence[Scenario], coarse_step: float, coarse: bool
    ) -> None:
        simulation, self._period = scenarios[0].simulation, scenarios[0].task.period
        fine = simulation.twin_time_step
        self._batches = {
            h: _SteppedBatch.of(scenarios, h) for h in {coarse_step or fine, fine}
        }
        is_coarse = coarse and 0.0 < 4.0 * coarse_step < self._period
        middle = coarse_step if is_coarse else fine
        self._time_steps = _time_steps(self._period, fine, middle)
        self._zero(coarse_step or fine)

    def ends(self, steps: Sequence[Steps]) -> list[Ends]:
        """See ImpactReplay."""
        counts = [len(each) for each in steps]
        which = np.repeat(np.arange(len(steps)), counts)
        # Steps without a balance may overflow, they end as NaN; others don't care.
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            ends = self._after(which, Steps.concatenated(steps))
        parts = (np.split(part, np.cumsum(counts)[:-1]) for part in ends)
        return [Ends(*each) for each in zip(*parts, strict=True)]

    def _zero(self, h: float) -> None:
        """Lets the bolts settle at A and zeroes the sensors.

        Where they come to rest does not depend on the steps' length.
        """
        batch = self._batches[h]
        twins = batch.twins(slice(None))
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            step = twins.plant_at_A.settled(batch.at_rest.state)
        reading = sensed_at_zeroing(
            twins.load_S(step.state.arm, step),
            twins.effects.sensor,
            twins.sensing(step.state.arm, np.zeros(batch.count)),
        )
        self.reading_at_zeroing = np.where(step.is_solved[:, None], reading, np.nan)
        self._offset = twins.processing.offset(self.reading_at_zeroing)

    def _after(self, which: np.ndarray, steps: Steps) -> Ends:
        """Returns where steps of some of the twins (n,) lead."""
        twins = {h: batch.twins(which) for h, batch in self._batches.items()}
        numbers = twins[self._time_steps[-1]].numbers
        q_bolt = steps.q + numbers.deflection(steps.wrench)
        p_BoTo_B = numbers.body.p_BoTo_B
        begin, end = (self._period * (steps.index + i) for i in (0, 1))
        motion = bolt_motion(
            numbers.coordinates, p_BoTo_B, q_bolt, steps.qd_rate, begin
        )
        plants = {h: each.plant(motion) for h, each in twins.items()}
        arm = np.hstack([steps.q, steps.v])
        state = PlantState(arm, q_bolt, steps.v + steps.give_rate, steps.qd)
        is_solved = np.ones(len(which), bool)
        for h, same in itertools.groupby(self._time_steps):
            step = plants[h].advance(state, steps.qd_rate, len(list(same)))
            state, is_solved = step.state, is_solved & step.is_solved
        found = _observed(twins[h], step, end, self._offset[which])
        give = state.q - state.arm[:, :6]
        parts = (np.where(is_solved[:, None], each, np.nan) for each in (found, give))
        return Ends(*parts)


@dataclasses.dataclass(frozen=True)
class _SteppedBatch:
    """Twins whose plants have one time step.

    Attributes:
        batch: of k twins.
        at_rest: them, at A.
    """

    batch: TwinBatch
    at_rest: Episodes

    @classmethod
    def of(cls, scenarios: Sequence[Scenario], h: float) -> Self:
        """Returns the twins of scenarios with steps of a length [s]."""
        stepped = [_with_time_step(scenario, h) for scenario in scenarios]
        batch = TwinBatch(stepped, np.zeros(0))
        return cls(batch, batch.at_rest(range(len(stepped)), stepped))

    @property
    def count(self) -> int:
        """How many twins."""
        return len(self.at_rest.steps)

    def twins(self, which: np.ndarray | slice) -> Twins:
        """Returns some of the twins, by their numbers (n,)."""
        return self.batch.twins(rows_of(self.at_rest, which))


def _observed(
    twins: Twins, step: PlantStep, time: np.ndarray, offset: np.ndarray
) -> np.ndarray:
    """Returns the states (n, 12) that are seen, their rotations as vectors.

    Args:
        twins: n of them.
        step: of their plants.
        time: (n,) since their episodes began [s].
        offset: (n, 6) of their sensors.
    """
    arm = step.state.arm
    X_GB = twins.numbers.coordinates.poses(arm[:, :6])
    load, sensing = twins.load_S(arm, step), twins.sensing(arm, time)
    reading = sensed(load, twins.effects.sensor, sensing)
    wrench = twins.processing.wrench(X_GB.R, reading, offset)
    return np.hstack([X_GB.p, rotation_vectors(X_GB.R), wrench])


def _with_time_step(scenario: Scenario, h: float) -> Scenario:
    simulation = dataclasses.replace(scenario.simulation, twin_time_step=h)
    return dataclasses.replace(scenario, simulation=simulation)


def _coarse_step(scenario: Scenario) -> float:
    """Returns about 10 ms that divide the period [s]; 0 if no such step will do."""
    period = scenario.task.period
    step = float(period / np.ceil(period / _COARSE - 1e-9))
    whole = step / scenario.simulation.twin_time_step
    if whole < 1.5 or abs(whole - round(whole)) > 1e-6:
        return 0.0
    arm = TwinNumbers.of(_with_time_step(scenario, step)).arm
    return step if arm.is_stable else 0.0


def _time_steps(period: float, fine: float, coarse: float) -> list[float]:
    """Returns the time steps of a period [s]: coarse ones between fine ones.

    Forces jump as a step of the task begins, where a coarse step may take a wrong root
    of the contact's equations; and its end is read. There two coarse steps each are
    made in fine ones.
    """
    ends = [fine] * round(2.0 * coarse / fine)
    return [*ends, *[coarse] * max(0, round(period / coarse) - 4), *ends]
