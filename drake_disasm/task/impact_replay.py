"""The twin with IMPACT, many steps of the task at once.

Without the hydroelastic query a step of this twin is a small system of equations
(`ImpactStep`); for all measured steps together it is a few array operations, and one
evaluation of the objective takes a fraction of the diagram's time
(docs/identification.md has the figures).
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from drake_disasm.batch.motion import TwinState, plant_step
from drake_disasm.batch.numbers import TwinNumbers
from drake_disasm.effects import environment_at, is_local
from drake_disasm.impact import NO_BALANCE, ImpactConditions, Surroundings
from drake_disasm.scenario import Scenario
from drake_disasm.stations.arm_node import ArmStep
from drake_disasm.task.replay import ReplayDiagram, Steps

_COARSE = 0.01  # s: with 20 ms, steps under friction ended twice as far off
_REST = 1e-6  # m/s, rad/s: in half a second less than the sensor can tell


class ImpactReplay:
    """Computes `TwinReplay.transitions` for a scenario with IMPACT contact, faster.

    The diagram stays the reference: it holds the parameters, zeroes the sensor and
    processes observations; only the steps themselves are computed here, by those of
    the batched twin (`plant_step`).

    Args:
        scenario: what the twin is, `contact.model` being impact.
        coarse: whether all but the end of a step may be simulated in coarse steps.
    """

    def __init__(self, scenario: Scenario, coarse: bool = False) -> None:
        self._coarse = coarse
        self._build(scenario)

    def _build(self, scenario: Scenario) -> None:
        self._diagram, self._scenario = ReplayDiagram(scenario), scenario
        self._body = TwinNumbers.of(scenario).body
        self._zero()

    def reconfigure(self, scenario: Scenario) -> None:
        """See TwinReplay."""
        if not self._diagram.can_reconfigure(scenario):
            self._build(scenario)
            return
        self._diagram.reconfigure(scenario)
        self._scenario = scenario
        self._zero()

    @property
    def reading_at_zeroing(self) -> np.ndarray:
        """See TwinReplay."""
        return self._diagram.reading_at_zeroing

    def transitions(self, steps: Steps) -> np.ndarray:
        """See TwinReplay.

        Raises:
            RuntimeError: the contact equations of a step have no solution.
        """
        deflection = self._diagram.station.deflection
        given = np.array([deflection(wrench) for wrench in steps.wrench])
        q, q_bolt, loads = self._after(steps, steps.q + given, self._time_steps())
        times = (steps.index + 1) * self._scenario.task.period
        rows = zip(times, q, q_bolt, loads, strict=True)
        return np.array([self._diagram.observed(*row) for row in rows])

    def _zero(self) -> None:
        """Lets the bolt settle at A, in coarse steps, and zeroes the sensor.

        Where it comes to rest does not depend on the steps' length.
        """
        rest, station = np.zeros((1, 6)), self._diagram.station
        stay = Steps(np.zeros(1), rest, rest, station.start[None], rest, rest, rest)
        h = self._coarse_step() or self._diagram.time_step
        time_steps = [h] * round(station.settling_time / h)
        settled = self._after(stay, rest, time_steps, until_rest=True)
        [state] = zip(*settled, strict=True)
        self._diagram.zero_at(*state)

    def _after(
        self,
        steps: Steps,
        q_bolt: np.ndarray,
        time_steps: Sequence[float],
        until_rest: bool = False,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Returns coordinates of arm and bolt, and loads on the sensor (n, 6) each.

        Args:
            steps: where arm and command begin, and how the command moves.
            q_bolt: (n, 6) where the bolt begins.
            time_steps: of the plant [s].
            until_rest: whether to stop before, as soon as nothing moves.
        """
        parameters = self._diagram.station.parameters
        conditions = self._conditions(steps, q_bolt)
        arms = {
            h: ArmStep.of(parameters.arm, parameters.grip, h) for h in set(time_steps)
        }
        before = np.hstack([steps.q, steps.v])
        state = TwinState(before, q_bolt, steps.v + steps.give_rate, steps.qd)
        for h in time_steps:
            sprung = conditions.sprung(arms[h].springs)
            step, v = (
                plant_step(state, steps.qd_rate, arms[h], self._body, sprung),
                state.v,
            )
            if not step.is_solved.all():
                raise RuntimeError(NO_BALANCE)
            state = step.state
            moves = max(np.abs(state.v).max(), np.abs(state.v - v).max())
            if until_rest and moves < _REST:
                break
        return state.arm[:, :6], state.q, step.load(self._body)

    def _conditions(self, steps: Steps, q_bolt: np.ndarray) -> ImpactConditions:
        """Returns the contact's conditions, per step where an effect is local."""
        conditions, effects = self._diagram.impact_conditions(), self._scenario.effects
        if not is_local(effects):
            return conditions
        nominal = self._diagram.station.lock.nominal
        rows = zip(q_bolt, steps.qd_rate, strict=True)
        motions = [self._diagram.motion(*row) for row in rows]
        around = Surroundings.of(
            [environment_at(nominal, effects, motion) for motion in motions]
        )
        return dataclasses.replace(conditions, around=around)

    def _time_steps(self) -> list[float]:
        """Returns the plant's steps within a period [s]."""
        period = self._scenario.task.period
        fine = self._scenario.simulation.twin_time_step
        coarse = self._coarse_step() if self._coarse else 0.0
        first = round(period / coarse) - 1 if coarse else 0
        rest = round((period - first * coarse) / fine)
        return [coarse] * first + [fine] * rest

    def _coarse_step(self) -> float:
        """Returns about 10 ms that divide the period [s]; 0 if no such step will do."""
        period = self._scenario.task.period
        step = period / np.ceil(period / _COARSE - 1e-9)
        whole = step / self._scenario.simulation.twin_time_step
        if whole < 1.5 or abs(whole - round(whole)) > 1e-6:
            return 0.0
        parameters = self._diagram.station.parameters
        arm = ArmStep.of(parameters.arm, parameters.grip, step)
        return float(step) if arm.is_stable else 0.0
