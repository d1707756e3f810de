"""How often closing the loop names an undeclared effect: the confusion matrix."""

import json
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from drake_disasm.common.executors import WorkerPool
from drake_disasm.common.finished_work import FinishedWork
from drake_disasm.common.progress import Progress, ProgressUpdate
from drake_disasm.effects import (
    Effect,
    EnvironmentEffect,
    MotionEffect,
    PoseEffect,
    SensorEffect,
    registered_effects,
)
from drake_disasm.logs import read_log
from drake_disasm.scenario import Scenario
from sysid.effect_selection.close_loop import close_loop
from sysid.effect_selection.verdict import Verdict
from sysid.models.twin import TwinModel
from sysid.objective import pseudo_residual, rms
from sysid.validation.random_effects import random_effect
from sysid.validation.synthetic_logs import transitions_log

_SMALL = (3, 25)  # episodes and steps of the log by which an amplitude is chosen


@dataclass(frozen=True)
class Case:
    """One blind test.

    Attributes:
        effects: names of the classes that are put in; none for a null log.
        level: rms that each leaves, in units of the noise.
        seed: of everything that is drawn.
        left_out: names of classes that the library lacks.
        correlation: of the noise from step to step.
    """

    effects: tuple[str, ...]
    level: float
    seed: int
    left_out: tuple[str, ...] = ()
    correlation: float = 0.0

    @property
    def key(self) -> str:
        """A text that identifies the case."""
        return json.dumps(asdict(self))


@dataclass(frozen=True)
class Answer:
    """What closing the loop said of a case.

    Attributes:
        case: that was run.
        drawn: the effects that were put in, as text.
        ending: of the verdict.
        names: confirmed or in an ambiguous set, the most important first.
        ties: the others of each one's set.
        before, after: error on held-out episodes, in units of the noise.
        suggested: names of effects that lower the error and are not confirmed.
    """

    case: Case
    drawn: tuple[str, ...]
    ending: str
    names: tuple[str, ...]
    ties: tuple[tuple[str, ...], ...]
    before: float
    after: float
    suggested: tuple[str, ...] = ()

    @property
    def named_first(self) -> bool:
        """Whether the effect, or each of several, leads the list."""
        count = len(self.case.effects)
        return set(self.names[:count]) == set(self.case.effects)

    @property
    def in_tie(self) -> bool:
        """Whether each effect is confirmed, or in a reported ambiguous set."""
        said = set(self.names) | {name for tie in self.ties for name in tie}
        return set(self.case.effects) <= said


def nominal() -> Scenario:
    """Returns what the logs state: the thesis's task, with the fast contact model.

    The grip is rigid: several newtons tell effects apart that a grip which yields
    hides behind the sensor's noise.
    """
    scenario = Scenario()
    scenario.gripper.compliance = "rigid"
    scenario.contact.model = "impact"
    return scenario


def observable_effects(scenario: Scenario) -> tuple[type[Effect], ...]:
    """Returns the effects that show in transitions of a scenario's twin."""
    parts = "", type(scenario.part).__name__
    acts = (EnvironmentEffect, MotionEffect, PoseEffect, SensorEffect)
    return tuple(
        effect
        for effect in registered_effects()
        if issubclass(effect, acts) and effect.is_physical
        if not getattr(effect, "removed_by_zeroing", False)
        if getattr(effect, "of_part", "") in parts
    )


def run_case(case: Case) -> Answer:
    """Returns what closing the loop says of a case's log, which declares no effect."""
    kinds = {effect.__name__: effect for effect in registered_effects()}
    random = np.random.default_rng([case.seed, len(case.effects)])
    with tempfile.TemporaryDirectory() as folder:
        effects = [
            random_effect(
                kinds[name], random, case.level, lambda e: residual(e, folder)
            )
            for name in case.effects
        ]
        log = Path(folder) / "log"
        transitions_log(
            log, nominal(), effects, case.seed, correlation=case.correlation
        )
        model = TwinModel([read_log(log)], nominal(), ())
        library = [e for e in registered_effects() if e.__name__ not in case.left_out]
        closed = close_loop(model, library=library)
    found, errors = closed.verdict, closed.errors
    names, ties = named_with_ties(found)
    return Answer(
        case,
        tuple(repr(effect) for effect in effects),
        found.ending,
        names,
        ties,
        errors.in_noise(errors.before),
        errors.in_noise(errors.after),
        found.suggested,
    )


def named_with_ties(
    found: Verdict,
) -> tuple[tuple[str, ...], tuple[tuple[str, ...], ...]]:
    """Returns the effects that are confirmed or ambiguous, and the rivals of each."""
    named = {*found.confirmed, *found.ambiguous}
    pairs = zip(found.names, found.ties, strict=True)
    kept = [(name, ties) for name, ties in pairs if name in named]
    return (
        tuple(name for name, _ in kept),
        tuple(tuple(tie.name for tie in ties) for _, ties in kept),
    )


def residual(effect: Effect, folder: str) -> float:
    """Returns the rms residual of the nominal twin on a small log with an effect.

    In units of the noise; the log has none. The loss is Huber's, as in the objective:
    else the one row in which the bolt misses an edge would dominate.
    """
    noiseless = nominal()
    noiseless.ft_sensor.noise = [0.0] * 6
    episodes, steps = _SMALL
    log = Path(folder) / f"probe_{len(list(Path(folder).iterdir()))}"
    transitions_log(log, noiseless, [effect], 0, episodes, steps)
    model = TwinModel([read_log(log)], nominal(), ())
    error = model.measurements.weighted(model.predictions(np.zeros(0)))
    return rms(pseudo_residual(error, model.default_huber_delta))


def run_cases(
    cases: Sequence[Case], pool: WorkerPool, finished: FinishedWork
) -> list[Answer]:
    """Returns the answers to cases; those that are kept are not run again.

    Args:
        cases: to run.
        pool: does the work.
        finished: keeps each answer.
    """
    open_cases = [case for case in cases if finished.get(case.key) is None]
    for case, found in pool.run(_run_one, open_cases):
        finished.keep(case.key, asdict(found))
    return [_answer_of(finished.get(case.key)) for case in cases]


def _run_one(case: Case, progress: Progress) -> Answer:
    found = run_case(case)
    progress(ProgressUpdate("blind tests", 1, 1))
    return found


def _answer_of(entry: dict[str, Any]) -> Answer:
    case = entry["case"]
    return Answer(
        **entry
        | {
            "case": Case(
                **case | {key: tuple(case[key]) for key in ("effects", "left_out")}
            ),
            "drawn": tuple(entry["drawn"]),
            "names": tuple(entry["names"]),
            "ties": tuple(tuple(tie) for tie in entry["ties"]),
            "suggested": tuple(entry["suggested"]),
        }
    )


def single_cases(levels: Sequence[float], seeds: Sequence[int]) -> list[Case]:
    """Returns every effect at every level with every seed."""
    return [
        Case((effect.__name__,), level, seed)
        for effect in observable_effects(nominal())
        for level in levels
        for seed in seeds
    ]


def several_cases(count: int, level: float, seeds: Sequence[int]) -> list[Case]:
    """Returns several different effects at once, drawn from all."""
    return [Case(e, level, s) for s, e in zip(seeds, _several(count), strict=False)]


def null_cases(correlations: Sequence[float], seeds: Sequence[int]) -> list[Case]:
    """Returns logs without an effect."""
    return [Case((), 0.0, s, correlation=rho) for rho in correlations for s in seeds]


def left_out_cases(level: float, seeds: Sequence[int]) -> list[Case]:
    """Returns every effect, each missing in the library."""
    return [
        Case((effect.__name__,), level, seed, left_out=(effect.__name__,))
        for effect in observable_effects(nominal())
        for seed in seeds
    ]


def _several(count: int) -> Iterator[tuple[str, ...]]:
    """Yields so many different effects, in a random, repeatable order."""
    names = [effect.__name__ for effect in observable_effects(nominal())]
    random = np.random.default_rng(0)
    while True:
        drawn = random.choice(len(names), count, replace=False)
        yield tuple(names[i] for i in drawn)
