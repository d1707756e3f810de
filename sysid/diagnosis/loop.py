"""Verdict, rivals, the experiment that separates them, and the verdict again."""

import dataclasses
import math
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import make_folder, read_json, write_json
from sysid.diagnosis.design import Prediction, is_enough
from sysid.diagnosis.rivals import NOTHING, TRIED, Need, Rival
from sysid.diagnosis.subject import Subject
from sysid.effect_selection.close_loop import ClosedLoop
from sysid.effect_selection.effect_names import short_names
from sysid.workers import Workers

_REFUTED = 3  # verdicts, until none of the library is believed
_TRUST = 0.5  # in what another experiment of the same class would separate

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


DEFAULT_BUDGET = Budget()


@dataclasses.dataclass(frozen=True)
class Round:
    """A verdict, and what was done about it.

    Attributes:
        verdict: in a sentence.
        names: effects that it names.
        leaves_more: whether it leaves more than noise and the model's own errors.
        rivals: weights of the hypotheses, by name.
        experiment: that was performed then, with its parameters; empty for none.
        episode: its number in the log.
        distance: by which it was to separate the two rivals that it separates best, in
            standard deviations.
        force, torque: greatest in it [N, N m].
        ended: why it was cut short; empty if it was performed whole.
        robot_time: of it [s].
        channel: in which rivals differ most there.
        unit: of that channel.
        predicted: by each rival, in that channel, by name, step by step (n + 1,).
        measured: (m + 1,) in that channel.
        periods: of rows that were predicted, and measured [s].
    """

    verdict: str
    names: tuple[str, ...]
    rivals: dict[str, float]
    leaves_more: bool = False
    experiment: str = ""
    episode: int = -1
    distance: float = 0.0
    force: float = 0.0
    torque: float = 0.0
    ended: str = ""
    robot_time: float = 0.0
    channel: str = ""
    unit: str = ""
    predicted: dict[str, list[float]] = dataclasses.field(default_factory=dict)
    measured: list[float] = dataclasses.field(default_factory=list)
    periods: tuple[float, float] = (0.0, 0.0)


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
        is_refuted: whether no name stands: experiments refuted one after the other, or
            the last ones leave more than noise and the model's own errors.
    """

    rounds: tuple[Round, ...]
    reason: str
    closed: ClosedLoop
    first_time: float
    predictions: tuple[Prediction, ...]
    rivals: tuple[Rival, ...]
    is_refuted: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """Effects that the last verdict confirms, if names stand."""
        return () if self.is_refuted else self.closed.verdict.confirmed

    @property
    def is_settled(self) -> bool:
        """Whether one hypothesis is left, guesses apart."""
        left = sum(not rival.is_guess for rival in self.rivals)
        return left == 1 and not self.is_refuted

    @property
    def robot_time(self) -> float:
        """Of all experiments [s]."""
        return self.first_time + sum(each.robot_time for each in self.rounds)


def pursue(
    subject: Subject,
    folder: Path,
    budget: Budget,
    confirm: Confirm,
    workers: Workers,
) -> Diagnosis:
    """Asks for the verdict and performs experiments, until one hypothesis is left.

    Args:
        subject: what is diagnosed.
        folder: of the fits and `diagnosis.json`.
        budget: after which no experiment begins.
        confirm: is asked before each experiment.
        workers: fit.

    Raises:
        DisasmError: the budget is too small for a first recording, the folder holds
            another subject's, or what close_loop and the station raise.
    """
    fits, session = folder / "fits", _Session(subject, folder)
    session.record_first(budget, confirm)
    plans = subject.plans()
    while True:
        closed = subject.verdict(workers, budget.verdict, fits)
        asked = [each.names for each in session.rounds]
        rivals = subject.rivals(closed, workers, fits, asked)
        refuted = why_refuted(session.rounds, closed)
        predictions, best, reason = [], None, refuted
        if not refuted:
            need, left = Need.of(closed), budget.robot - session.robot_time
            predictions = session.predict(plans, rivals, need)
            best, reason = _choice(closed, rivals, predictions, need, left, asked)
        if best is not None and not confirm(f"{closed.sentence} {_question(best)}"):
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
                bool(refuted) or _stands_for_another(closed),
            )
        session.experiment(closed, rivals, best)


def _choice(
    closed: ClosedLoop,
    rivals: Sequence[Rival],
    predictions: Sequence[Prediction],
    need: Need,
    left: float,
    asked: Sequence[tuple[str, ...]],
) -> tuple[Prediction | None, str]:
    """Returns the experiment to perform, or why there is none.

    What is merely suggested a second recording has to show, whichever it is.

    Args:
        closed: the verdict.
        rivals: that it leaves.
        predictions: of experiments that were not performed yet, the best first.
        need: how far apart rivals have to be.
        left: robot time [s].
        asked: names of the verdict before each experiment.
    """
    if len(rivals) < 2:
        return None, _settled(closed)
    affordable = [p for p in predictions if not p.hazard and p.duration <= left]
    helpful = [p for p in affordable if p.is_helpful]
    if is_enough(helpful, rivals, need, left):
        return helpful[0], ""
    verdict = closed.verdict
    if verdict.suggested and affordable and asked.count(verdict.names) < TRIED:
        return affordable[0], ""
    if all(rival.is_guess for rival in rivals[1:]):
        return None, _settled(closed)
    if is_enough(predictions, rivals, need, math.inf):
        return None, (
            f"the budget is spent: with the {left:.0f} s that are left no experiments "
            f"separate {_first_two(rivals)}"
        )
    return None, _inseparable(rivals, predictions)


def _settled(closed: ClosedLoop) -> str:
    """Returns why a single hypothesis ends a diagnosis."""
    if closed.verdict.ending == "unexplained":
        return "what the model lacks is not in the library"
    names = short_names(closed.verdict.confirmed) or NOTHING
    if _stands_for_another(closed):
        return (
            f"not in the library: what comes nearest, {names}, leaves more than noise "
            "and the model's own errors"
        )
    if closed.verdict.ending == "partly":
        names += ", and something that is not in the library"
    return f"settled: the model lacks {names}"


def _leaves_more(closed: ClosedLoop) -> bool:
    """Returns whether a verdict leaves more than noise and the model's stated errors.

    Another effect that the library has would have been named beside: either there is
    one that it lacks, which these names stand for, or there are these and one more.
    """
    verdict, measured = closed.verdict, closed.last.model.measurements
    return verdict.has_remainder and measured.model_error is not None


def _stands_for_another(closed: ClosedLoop) -> bool:
    """Returns whether what is confirmed stands for what the library lacks."""
    return bool(closed.verdict.confirmed) and _leaves_more(closed)


def why_refuted(rounds: Sequence[Round], closed: ClosedLoop) -> str:
    """Returns why none of the library is believed; empty if one may be.

    Args:
        rounds: so far, each with the experiment after its verdict.
        closed: the verdict after the last.
    """
    refuted = refuted_names([each.names for each in rounds], closed.verdict.names)
    if len(refuted) >= _REFUTED:
        return (
            f"no name stands: experiments refuted {'; '.join(refuted)}, one after the "
            "other; what the model lacks is not in the library"
        )
    if len(rounds) < TRIED or not _leaves_more(closed):
        return ""
    if not all(each.leaves_more for each in rounds[1 - TRIED :]):
        return ""
    return (
        "no name stands: more than noise and the model's own errors is left after each "
        f"of the last {TRIED} experiments; what the model lacks is not in the library"
    )


def refuted_names(
    asked: Sequence[Sequence[str]], names: Sequence[str]
) -> tuple[str, ...]:
    """Returns the different verdicts of which no name is left.

    Those that share a name are one.

    Args:
        asked: names of the verdict before each experiment.
        names: of the verdict after the last.
    """
    found, known = [], set(names)
    for each in asked:
        if each and not known & set(each):
            found.append(short_names(sorted(each)))
            known |= set(each)
    return tuple(found)


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
    force, torque = best.forecast.greatest
    most = f"{force:.1f} N" if force else f"{torque:.1f} N m at any joint"
    return f"{_about(best.plan, best.duration)}, at most {most} under any hypothesis"


def _about(plan: Any, duration: float) -> str:
    """Returns an experiment, and how long it takes."""
    return f"{plan.text}: about {duration:.0f} s"


class _Session:
    """What was performed on a subject, kept in a file.

    Attributes:
        rounds: so far.
        first_time: robot time before the first verdict [s].
    """

    def __init__(self, subject: Subject, folder: Path) -> None:
        self._subject = subject
        make_folder(folder)
        self._file = folder / "diagnosis.json"
        self.rounds: list[Round] = []
        self.first_time = 0.0
        self._read()

    @property
    def robot_time(self) -> float:
        """Used so far [s]."""
        return self.first_time + sum(each.robot_time for each in self.rounds)

    def record_first(self, budget: Budget, confirm: Confirm) -> None:
        """Records what the first verdict needs, as far as the log lacks it."""
        subject = self._subject
        plans = subject.first()[subject.log.episodes :]
        if not plans:
            return
        foreseen = subject.foreseen(plans)
        self._refuse(plans, foreseen, budget)
        for plan, (duration, _) in zip(plans, foreseen, strict=True):
            if not confirm(f"before the first verdict: {_about(plan, duration)}"):
                raise DisasmError("stopped by hand before the first verdict")
            self.first_time += subject.log.perform(plan).duration
            self._write("")
            subject.log.refuse_hold()

    def _refuse(
        self,
        plans: Sequence[Any],
        foreseen: Sequence[tuple[float, str]],
        budget: Budget,
    ) -> None:
        """Refuses first experiments that are not safe, or take too long."""
        for plan, (_, hazard) in zip(plans, foreseen, strict=True):
            if hazard:
                raise DisasmError(
                    f"{plan.text}, before the first verdict, is not performed: {hazard}"
                )
        needed = self.first_time + sum(duration for duration, _ in foreseen)
        if needed > budget.robot:
            raise DisasmError(
                f"budget: {budget.robot:g} s of robot time; recordings before the "
                f"first verdict take about {needed:.0f} s, give more"
            )

    def predict(
        self, plans: Sequence[Any], rivals: Sequence[Rival], need: Need
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
        return self._subject.predict(left, rivals, need, trust, done)

    def experiment(
        self, closed: ClosedLoop, rivals: Sequence[Rival], chosen: Prediction
    ) -> None:
        """Performs an experiment and adds it to the log."""
        log, forecast = self._subject.log, chosen.forecast
        number, found = log.episodes, log.perform(chosen.plan)
        force, torque = found.greatest
        pairs = zip(rivals, forecast.shown, strict=True)
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
                channel=forecast.channel,
                unit=forecast.unit,
                predicted={rival.name: shown.tolist() for rival, shown in pairs},
                measured=found.channel(forecast.channel).tolist(),
                periods=(forecast.period, found.period),
            )
        )
        self._write("")
        log.refuse_hold()

    def close(self, closed: ClosedLoop, rivals: Sequence[Rival], reason: str) -> None:
        """Notes the last verdict, which has no experiment, and why it is the last."""
        self.rounds.append(_round(closed, rivals))
        self._write(reason)

    def _read(self) -> None:
        """Takes up what an earlier call has done.

        Raises:
            DisasmError: it was of another subject.
        """
        if not self._file.exists():
            return
        settings = self._subject.settings
        known: dict[str, Any] = read_json(
            self._file, "name another folder", {**dict.fromkeys(settings), "rounds": []}
        )
        for name, value in settings.items():
            if known[name] != value:
                raise DisasmError(
                    f"{self._file}: is of another {name}; give that, or another folder"
                )
        self.first_time = float(known["first_time"])
        for each in known["rounds"]:
            if each["experiment"]:
                self.rounds.append(Round(**each | {"names": tuple(each["names"])}))

    def _write(self, reason: str) -> None:
        write_json(
            self._file,
            {
                **self._subject.settings,
                "first_time": self.first_time,
                "rounds": [dataclasses.asdict(each) for each in self.rounds],
                "reason": reason,
            },
        )


def _round(closed: ClosedLoop, rivals: Sequence[Rival]) -> Round:
    weights = {rival.name: rival.weight for rival in rivals}
    more = _leaves_more(closed)
    return Round(closed.sentence, closed.verdict.names, weights, more)
