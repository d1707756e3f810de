"""Verdict, rivals, the experiment that separates them, and the verdict again."""

import dataclasses
import math
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import make_folder, read_json, write_json
from drake_disasm.common.progress import Progress, ignore_progress
from drake_disasm.effects import Effect
from drake_disasm.experiments import Experiment, Plan, Removal, registered_experiments
from drake_disasm.mdp import STATE_NAMES
from drake_disasm.scenario import Scenario, scenario_to_mapping
from drake_disasm.task.simulation import StationFactory
from drake_disasm.visualization import MeshcatView
from sysid.diagnosis.design import Prediction, is_enough, predict
from sysid.diagnosis.growing_log import GrowingLog
from sysid.diagnosis.rivals import NOTHING, Need, Rival, rivals_of
from sysid.effect_selection.close_loop import ClosedLoop
from sysid.workers import Workers

_TRUST = 0.5  # in what another experiment of the same class would separate
_FIRST = 3  # removals before the first verdict

#: Is asked before each experiment, with what it is; False ends the diagnosis.
Confirm = Callable[[str], bool]


@dataclasses.dataclass(frozen=True)
class Budget:
    """How much a diagnosis may cost.

    Attributes:
        robot: time of the robot [s].
        verdict: time of the computer for each verdict [s].
    """

    robot: float = 300.0
    verdict: float = math.inf


@dataclasses.dataclass(frozen=True)
class Round:
    """A verdict, and what was done about it.

    Attributes:
        verdict: in a sentence.
        names: effects that it names.
        rivals: weights of the hypotheses, by name.
        experiment: that was performed then, with its parameters; empty for none.
        episode: its number in the log.
        distance: by which it was to separate the two rivals that it separates best, in
            standard deviations.
        force, torque: greatest in it [N, N m].
        ended: why it was cut short; empty if it was performed whole.
        robot_time: of it [s].
        channel: of the state, in which rivals differ most there.
        predicted: by each rival, in that channel, by name, step by step (n + 1,).
        measured: (m + 1,) in that channel.
    """

    verdict: str
    names: tuple[str, ...]
    rivals: dict[str, float]
    experiment: str = ""
    episode: int = -1
    distance: float = 0.0
    force: float = 0.0
    torque: float = 0.0
    ended: str = ""
    robot_time: float = 0.0
    channel: str = ""
    predicted: dict[str, list[float]] = dataclasses.field(default_factory=dict)
    measured: list[float] = dataclasses.field(default_factory=list)


@dataclasses.dataclass(frozen=True)
class Diagnosis:
    """What came of it.

    Attributes:
        rounds: in their order; the last has no experiment.
        reason: why it ended, in a sentence.
        closed: the last verdict.
        first_time: robot time before the first verdict [s].
        predictions: of the last round's experiments, the best first.
        rivals: of the last round.
    """

    rounds: tuple[Round, ...]
    reason: str
    closed: ClosedLoop
    first_time: float
    predictions: tuple[Prediction, ...]
    rivals: tuple[Rival, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Effects that the last verdict confirms."""
        return self.closed.verdict.confirmed

    @property
    def is_settled(self) -> bool:
        """Whether one hypothesis is left."""
        return len(self.rivals) == 1

    @property
    def robot_time(self) -> float:
        """Of all experiments [s]."""
        return self.first_time + sum(each.robot_time for each in self.rounds)


def diagnose(
    scenario: Scenario,
    folder: Path,
    *,
    station: str | StationFactory = "cell",
    real: Scenario | None = None,
    budget: Budget = Budget(),
    experiments: Sequence[type[Experiment]] | None = None,
    effects: Sequence[type[Effect]] | None = None,
    confirm: Confirm = lambda _: True,
    view: MeshcatView | None = None,
    workers: Workers | None = None,
    progress: Progress = ignore_progress,
) -> Diagnosis:
    """Finds out what a scenario's model lacks, by experiments on a station.

    Records some removals, asks for the verdict, performs the experiment that separates
    best what the verdict leaves, adds it to the log, and asks again, until one
    hypothesis is left, no experiment would help, or the budget is spent. The same call
    goes on where it was stopped.

    Args:
        scenario: of the model, which the log states.
        folder: of the log, the fits and `diagnosis.json`.
        station: "cell", "twin", or what makes the hardware's.
        real: scenario of a simulated station; the model's if left out.
        budget: after which no experiment begins.
        experiments: to choose from; all registered ones if left out.
        effects: that may be named; all registered ones if left out.
        confirm: is asked before each experiment.
        view: shows the station, see GrowingLog.
        workers: fit.
        progress: gets each step.

    Raises:
        DisasmError: the budget is too small for a first recording, the folder holds
            another scenario's, or what close_loop and the station raise.
    """
    workers, fits = workers or Workers(), folder / "fits"
    session = _Session(scenario, folder, station, real or scenario, view, progress)
    session.record_first(budget, confirm)
    plans = _plans(scenario, experiments)
    while True:
        closed = session.log.verdict(effects, workers, budget.verdict, fits)
        rivals = rivals_of(closed, session.log, workers, fits, len(session.rounds))
        need = Need.of(closed)
        predictions = session.predict(plans, rivals, need)
        left = budget.robot - session.robot_time
        best, reason = _choice(closed, rivals, predictions, need, left)
        if best is not None and not confirm(_question(best)):
            best, reason = None, "stopped by hand; the same command goes on from here"
        if best is None:
            session.close(closed, rivals, reason)
            return Diagnosis(
                tuple(session.rounds),
                reason,
                closed,
                session.first_time,
                tuple(predictions),
                rivals,
            )
        session.experiment(closed, rivals, best)


def _plans(scenario: Scenario, kinds: Sequence[type[Experiment]] | None) -> list[Plan]:
    """Returns all experiments that a scenario has anything to do with."""
    kinds = registered_experiments() if kinds is None else kinds
    kinds = [kind for kind in kinds if kind is not Removal]
    plans = [e.plan(scenario) for kind in kinds for e in kind.variants()]
    return [plan for plan in plans if plan.phases]


def _choice(
    closed: ClosedLoop,
    rivals: Sequence[Rival],
    predictions: Sequence[Prediction],
    need: Need,
    left: float,
) -> tuple[Prediction | None, str]:
    """Returns the experiment to perform, or why there is none.

    Args:
        closed: the verdict.
        rivals: that it leaves.
        predictions: of experiments that were not performed yet, the best first.
        need: how far apart rivals have to be.
        left: robot time [s].
    """
    if len(rivals) < 2:
        return None, _settled(closed)
    if not is_enough(predictions, rivals, need, math.inf):
        if closed.verdict.ending == "unexplained":  # its rivals are guesses
            return None, _settled(closed)
        return None, _inseparable(rivals, predictions)
    affordable = [p for p in predictions if p.is_helpful and p.duration <= left]
    if not is_enough(affordable, rivals, need, left):
        return None, (
            f"the budget is spent: with the {left:.0f} s that are left no experiments "
            f"separate {_first_two(rivals)}"
        )
    return affordable[0], ""


def _settled(closed: ClosedLoop) -> str:
    """Returns why a single hypothesis ends a diagnosis."""
    if closed.verdict.ending == "unexplained":
        return "what the model lacks is not in the library"
    names = " and ".join(closed.verdict.confirmed) or NOTHING
    return f"settled: the model lacks {names}"


def _first_two(rivals: Sequence[Rival]) -> str:
    return " and ".join(rival.name for rival in rivals[:2])


def _inseparable(rivals: Sequence[Rival], predictions: Sequence[Prediction]) -> str:
    """Returns why no experiment is performed, with the proof."""
    names = _first_two(rivals)
    safe = [p for p in predictions if not p.hazard]
    if not safe:
        first = next((p.hazard for p in predictions), "there is no experiment")
        return f"no experiment is safe: {first}"
    most = max(safe, key=lambda p: float(p.bounds.max(initial=0.0)))
    largest = most.bounds.argmax()
    return (
        f"no experiment separates {names}: the largest difference that any predicts is "
        f"{most.bounds.flat[largest]:.1f} standard deviations, of {most.plan.text}, "
        f"and the verdict needs {most.needed.flat[largest]:.1f}"
    )


def _question(best: Prediction) -> str:
    """Returns what a person is asked before an experiment."""
    force = max(each.greatest[0] for each in best.performances)
    return (
        f"{best.plan.text}: {best.duration:.0f} s, at most {force:.1f} N under any "
        "hypothesis"
    )


class _Session:
    """A folder with a log that grows, and what is known of it.

    Attributes:
        log: of all experiments.
        rounds: so far.
        first_time: robot time before the first verdict [s].
    """

    def __init__(
        self,
        scenario: Scenario,
        folder: Path,
        station: str | StationFactory,
        real: Scenario,
        view: MeshcatView | None,
        progress: Progress,
    ) -> None:
        self._scenario, self._folder = scenario, folder
        self._progress = progress
        make_folder(folder)
        self._file = folder / "diagnosis.json"
        self.rounds: list[Round] = []
        self.first_time = 0.0
        self._read()
        self.log = GrowingLog(scenario, folder / "log", station, real, progress, view)

    @property
    def robot_time(self) -> float:
        """Used so far [s]."""
        return self.first_time + sum(each.robot_time for each in self.rounds)

    def record_first(self, budget: Budget, confirm: Confirm) -> None:
        """Records removals, if the log has none."""
        for number in range(self.log.episodes, _FIRST):
            plan = Removal(seed=number).plan(self._scenario)
            if self.first_time > budget.robot:
                raise DisasmError(
                    f"budget: {budget.robot:g} s are spent before the first verdict; "
                    "give more"
                )
            most = plan.most_steps * plan.period
            if not confirm(f"{plan.text}: at most {most:.0f} s"):
                raise DisasmError("stopped by hand before the first verdict")
            self.first_time += self.log.perform(plan).duration
            self._write("")
            self.log.refuse_hold()

    def predict(
        self, plans: Sequence[Plan], rivals: Sequence[Rival], need: Need
    ) -> list[Prediction]:
        """Returns what rivals predict of experiments that were not performed yet.

        Of a class that was performed, and after which the question is still open,
        predictions count half as much each time.
        """
        if len(rivals) < 2:
            return []
        done = {each.experiment for each in self.rounds}
        left = [plan for plan in plans if plan.text not in done]
        classes = Counter(text.partition("(")[0] for text in done)
        trust = {name: _TRUST**count for name, count in classes.items()}
        return predict(left, rivals, need, self._progress, self.log.limits, trust)

    def experiment(
        self, closed: ClosedLoop, rivals: Sequence[Rival], chosen: Prediction
    ) -> None:
        """Performs an experiment and adds it to the log."""
        number = self.log.episodes
        found = self.log.perform(chosen.plan)
        (force, torque), i = found.greatest, chosen.channel
        pairs = zip(rivals, chosen.replayed, strict=True)
        self.rounds.append(
            dataclasses.replace(
                _round(closed, rivals),
                experiment=chosen.plan.text,
                episode=number,
                distance=chosen.farthest,
                force=force,
                torque=torque,
                ended=found.ended,
                robot_time=found.duration,
                channel=STATE_NAMES[i],
                predicted={r.name: p.observations[:, i].tolist() for r, p in pairs},
                measured=found.observations[:, i].tolist(),
            )
        )
        self._write("")
        self.log.refuse_hold()

    def close(self, closed: ClosedLoop, rivals: Sequence[Rival], reason: str) -> None:
        """Notes the last verdict, which has no experiment, and why it is the last."""
        self.rounds.append(_round(closed, rivals))
        self._write(reason)

    def _read(self) -> None:
        """Takes up what an earlier call has done.

        Raises:
            DisasmError: it was of another scenario.
        """
        if not self._file.exists():
            return
        known: dict[str, Any] = read_json(
            self._file, "name another folder", {"scenario": {}, "rounds": []}
        )
        if known["scenario"] != scenario_to_mapping(self._scenario):
            raise DisasmError(
                f"{self._file}: is of another scenario; give it, or another folder"
            )
        self.first_time = float(known["first_time"])
        for each in known["rounds"]:
            if each["experiment"]:
                self.rounds.append(Round(**each | {"names": tuple(each["names"])}))

    def _write(self, reason: str) -> None:
        write_json(
            self._file,
            {
                "scenario": scenario_to_mapping(self._scenario),
                "first_time": self.first_time,
                "rounds": [dataclasses.asdict(each) for each in self.rounds],
                "reason": reason,
            },
        )


def _round(closed: ClosedLoop, rivals: Sequence[Rival]) -> Round:
    weights = {rival.name: rival.weight for rival in rivals}
    return Round(closed.sentence, closed.verdict.names, weights)
