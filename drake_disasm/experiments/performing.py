"""Performing an experiment on a station, and what came of it."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from drake_disasm.common.progress import Progress, ProgressUpdate, ignore_progress
from drake_disasm.effects import PoseEffect, pose_weights
from drake_disasm.experiments.base import Plan
from drake_disasm.experiments.performer import Performer
from drake_disasm.mdp import STATE_NAMES, BoltState, Outcome, TaskGeometry
from drake_disasm.safety import SafetyConfig
from drake_disasm.scenario import Scenario
from drake_disasm.stations import Station
from drake_disasm.stations.hardware import HardwareStation, HoldError
from drake_disasm.task.episode import Recorder
from drake_disasm.task.simulation import (
    Observer,
    StationFactory,
    StepResult,
    TaskSimulation,
)
from drake_disasm.twin.batch import BatchedTwin

#: A state (12,), or several.
Array = np.ndarray

_LOADS = (Outcome.FORCE_LIMIT, Outcome.TORQUE_LIMIT)


@dataclasses.dataclass(frozen=True)
class Performance:
    """What a station measured during an experiment.

    Attributes:
        observations: (n + 1, 12) states of the task.
        actions: (n, 6) that the experiment asked for.
        ended: why it was cut short; empty if it was performed whole.
        period: of a step [s].
    """

    observations: np.ndarray
    actions: np.ndarray
    ended: str
    period: float

    @property
    def duration(self) -> float:
        """Robot time [s]."""
        return (len(self.observations) - 1) * self.period

    @property
    def greatest(self) -> tuple[float, float]:
        """Greatest force and torque on the bolt [N, N m]."""
        state = BoltState.from_vector(self.observations)
        return float(state.force.max()), float(state.torque.max())

    def channel(self, name: str) -> np.ndarray:
        """Returns what was measured in a channel of the state (n + 1,)."""
        return np.asarray(self.observations[:, STATE_NAMES.index(name)])


class Laboratory:
    """A station on which one experiment after the other is performed.

    Args:
        scenario: of the station.
        station: see TaskSimulation.
        observers: see TaskSimulation: a `MeshcatView`, say.
    """

    def __init__(
        self,
        scenario: Scenario,
        station: str | StationFactory,
        observers: Sequence[Observer] = (),
    ) -> None:
        self._performer = Performer()
        self.simulation = TaskSimulation(scenario, station, self._performer, observers)

    @property
    def station(self) -> Station:
        """On which they are performed."""
        return self.simulation.station

    @property
    def limits(self) -> SafetyConfig | None:
        """At which the station holds; None for a simulated one."""
        station = self.station
        return station.config.safety if isinstance(station, HardwareStation) else None

    def perform(
        self,
        plan: Plan,
        seed: int = 0,
        recorder: Recorder | None = None,
        progress: Progress = ignore_progress,
    ) -> Performance:
        """Performs an experiment, from where an episode begins.

        Args:
            plan: of it.
            seed: of the sensor's noise.
            recorder: gets every row, if given.
            progress: gets each step.
        """
        simulation, performer = self.simulation, self._performer
        performer.plan = plan
        found, actions = [simulation.reset(seed)], []
        if recorder:
            recorder.measure()
        while True:
            try:
                result = simulation.step()
            except HoldError as error:
                ended = str(error)
                break
            found.append(result.observation)
            actions.append(simulation.action())
            ended = _ended(result, simulation.systems.monitor.geometry)
            is_over = bool(ended) or performer.is_done
            if recorder:
                recorder.acted(_in_a_log(result, is_over))
            update = f"{type(plan.experiment).__name__}"
            progress(ProgressUpdate(update, len(found) - 1, plan.most_steps))
            if is_over:
                break
        performed = np.array(actions).reshape(-1, 6)
        return Performance(np.array(found), performed, ended, plan.period)


def perform_side_by_side(
    scenarios: Sequence[Scenario],
    plans: Sequence[Plan],
    progress: Progress = ignore_progress,
) -> list[list[Performance]]:
    """Returns experiments on some twins, each in an environment of one batch.

    Args:
        scenarios: of the twins, with IMPACT contact, without noise.
        plans: of experiments.
        progress: gets each step.

    Returns:
        For each twin all experiments.

    Raises:
        DisasmError: the batch does not have a scenario's effects or contact.
    """
    usual = 2.0 * float(np.median([plan.most_steps for plan in plans]))
    short = [n for n, plan in enumerate(plans) if plan.most_steps <= usual]
    long = [n for n in range(len(plans)) if n not in short]  # nothing waits for these
    found: dict[int, Sequence[Performance]] = {}
    for numbers in (short, long):
        if numbers:
            done = _batch(scenarios, [plans[n] for n in numbers], progress)
            found.update(zip(numbers, zip(*done, strict=True), strict=True))
    return [[found[n][row] for n in range(len(plans))] for row in range(len(scenarios))]


def _batch(
    scenarios: Sequence[Scenario], plans: Sequence[Plan], progress: Progress
) -> list[list[Performance]]:
    rows = [scenario for scenario in scenarios for _ in plans]
    twin = BatchedTwin([_without_pose_effects(row) for row in rows], device="numpy")
    report = _ReportedPoses(rows)
    geometry = TaskGeometry.of(scenarios[0], np.zeros((6, 6)))
    performers = [Performer(plan) for _ in scenarios for plan in plans]
    states = [report(twin.reset([0] * len(rows)).copy())]
    actions: list[np.ndarray] = []
    ended, steps = [""] * len(rows), np.zeros(len(rows), int)
    running = np.ones(len(rows), bool)
    most = max(plan.most_steps for plan in plans)
    while running.any():
        progress(ProgressUpdate("predicting", len(actions), most))
        pairs = zip(performers, states[-1], strict=True)
        result = twin.step(np.array([act(state) for act, state in pairs]))
        actions.append(twin.action.copy())
        states.append(report(result.observation.copy()))
        steps += running
        for i in np.flatnonzero(running).tolist():
            outcome = Outcome(int(result.outcome[i]))
            failure = _failure(outcome, result.observation[i], geometry)
            ended[i] = result.failure[i] or failure
            running[i] = not (ended[i] or performers[i].is_done)
    table, asked = np.array(states), np.array(actions)
    found = iter(
        Performance(table[: n + 1, i], asked[:n, i], ended[i], twin.period)
        for i, n in enumerate(steps.tolist())
    )
    return [[next(found) for _ in plans] for _ in scenarios]


def _without_pose_effects(scenario: Scenario) -> Scenario:
    kept = [each for each in scenario.effects if not isinstance(each, PoseEffect)]
    return dataclasses.replace(scenario, effects=kept)


class _ReportedPoses:
    """What rows report of their poses: a batch knows these as they are.

    Args:
        rows: scenarios, with their effects on the measured pose.
    """

    def __init__(self, rows: Sequence[Scenario]) -> None:
        each = [pose_weights(row.effects, row.task.period) for row in rows]
        self._weights = np.zeros((max(map(len, each)), len(rows), 1))
        for number, weights in enumerate(each):
            self._weights[: len(weights), number, 0] = weights
        self._newest_first: list[Array] = []

    def __call__(self, states: Array) -> Array:
        """Returns states (rows, 12) with the poses that are reported."""
        past, count = self._newest_first, len(self._weights)
        past.insert(0, states[:, :6])
        del past[count:]
        ago = [past[min(k, len(past) - 1)] for k in range(count)]
        return np.hstack([np.sum(self._weights * np.array(ago), axis=0), states[:, 6:]])


def _ended(result: StepResult, geometry: TaskGeometry) -> str:
    """Returns why an experiment can't go on; that the bolt is out ends none."""
    if not result.is_whole:
        return "the station did not come to the step's end"
    return _failure(result.outcome, result.observation, geometry)


def _failure(outcome: Outcome, observation: Array, geometry: TaskGeometry) -> str:
    """Returns in what an experiment has failed; empty if it goes on.

    A bolt leaves the workspace where the measured pose says so, too: the task adds what
    the grip yields to the reading, and to one that drifts it yields nothing.
    """
    p = observation[:3]
    is_inside = np.all((geometry.low <= p) & (p <= geometry.high))
    is_failure = outcome in _LOADS or (outcome is Outcome.WORKSPACE and not is_inside)
    return outcome.label if is_failure else ""


def _in_a_log(result: StepResult, is_over: bool) -> StepResult:
    """Returns a step as the log has it: an episode ends with the experiment."""
    outcome = Outcome.STEP_LIMIT if is_over else Outcome.RUNNING
    if result.outcome in _LOADS:
        outcome = result.outcome
    return dataclasses.replace(result, outcome=outcome)
