"""From a model of a log to the effect that the model lacks."""

import dataclasses
import functools
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.progress import Progress, ProgressUpdate, ignore_progress
from drake_disasm.effects import Effect, Imprecision, registered_effects
from drake_disasm.scenario import Scenario
from sysid.data_checks.constancy import dead_channels
from sysid.data_checks.contradictions import contradicting_rows
from sysid.data_checks.finding import refuse
from sysid.effect_selection.bookkeeping import best_hypothesis
from sysid.effect_selection.data_sufficiency import refuse_few_rows, refuse_rest
from sysid.effect_selection.search import SearchResult, search
from sysid.effect_selection.urdf_difference import UrdfDifference, urdf_difference
from sysid.effect_selection.verdict import Verdict, judge
from sysid.effect_selection.verdict_words import (
    not_told_apart,
    verdict_sentence,
    verdict_text,
)
from sysid.fitting.candidates import Candidate, candidates
from sysid.fitting.fit import Fit
from sysid.fitting.fitter import Fitter
from sysid.fitting.settings import DEFAULT_SETTINGS, SelectionSettings
from sysid.identification.noise import with_noise_of
from sysid.identification.split import train_and_test
from sysid.models.base import LogModel
from sysid.models.bookkeeping import Bookkeeping
from sysid.residuals.command_scatter import (
    CommandScatter,
    fit_command_scatter,
)
from sysid.residuals.held_out import HeldOut, held_out_errors
from sysid.residuals.residual_model import fit_residual_model
from sysid.workers import Workers

_SEARCHED = 0.75  # of the time: the rest is for errors and the verdict
_MOST_REWRITES = 3  # ways in which a log may have been written wrongly
_PROVISIONAL = (
    "provisional: the time was over while {phase}{untested}; the same command without "
    "a budget, or with another, goes on from here"
)


@dataclass(frozen=True)
class ClosedLoop:
    """What closing the loop found.

    Attributes:
        verdict: what is missing, with where each effect stands and its parameters.
        errors: measured and predicted held-out rows, without and with the effects.
        search: how the effects were chosen.
        scatter: about the commands, if the arm has that.
    """

    verdict: Verdict
    errors: HeldOut
    search: SearchResult
    scatter: CommandScatter | None

    @property
    def first(self) -> Fit:
        """The model fitted without effects."""
        return self.search.first

    @property
    def last(self) -> Fit:
        """The model fitted with them."""
        return self.search.last

    @property
    def is_provisional(self) -> bool:
        """Whether the time was over before the search was."""
        return self.verdict.is_provisional

    @property
    def derived(self) -> dict[str, tuple[float, str]]:
        """What follows from the parameters, with units: the weight of a load, say."""
        return self.last.model.describe(self.last.theta)

    @functools.cached_property
    def urdf_difference(self) -> UrdfDifference | None:
        """How rigid bodies that were identified differ from the URDF's."""
        return urdf_difference(self.last)

    @property
    def sentence(self) -> str:
        """The verdict in plain English."""
        return verdict_sentence(self.verdict, self.errors)

    @property
    def not_told_apart(self) -> str:
        """What the log can't tell apart, in plain English; empty for nothing."""
        return not_told_apart(self.verdict)

    @property
    def text(self) -> str:
        """The verdict in lines: sentences, effects, what to record, errors, derived.

        A provisional one says so in a line before them.
        """
        text = verdict_text(self.verdict, self.errors)
        if self.derived:
            values = (f"{n} {v:.3g} {unit}" for n, (v, unit) in self.derived.items())
            text += f"\nderived: {', '.join(values)}"
        if self.urdf_difference is not None:
            text += f"\n{self.urdf_difference.sentence}"
        if not self.is_provisional:
            return text
        count = len(self.search.untested)
        untested = f", {count} of them not yet" if count else ""
        said = _PROVISIONAL.format(phase=self.search.phase, untested=untested)
        return f"{said}\n{text}"

    @property
    def scenario(self) -> Scenario | None:
        """The identified scenario with the effects; None if the model has none.

        Without a residual model, which needs a file.
        """
        scenario = self.last.model.scenario_at(self.last.theta)
        if scenario is None or self.scatter is None:
            return scenario
        more = Imprecision(*self.scatter.std.tolist())
        return dataclasses.replace(scenario, effects=[*scenario.effects, more])

    def scenario_with_residual_model(self, file: str) -> Scenario | None:
        """Returns the scenario with the learned effect, too, if there is one.

        Args:
            file: to which its functions are saved, as the scenario names it.
        """
        scenario, model = self.scenario, self.verdict.residual_model
        if scenario is None or model is None:
            return scenario
        effects: list[Any] = [*scenario.effects, model.effect(file)]
        return dataclasses.replace(scenario, effects=effects)


def close_loop(
    model: LogModel,
    *,
    train: Sequence[int] | None = None,
    test: Sequence[int] | None = None,
    huber_delta: float | None = None,
    settings: SelectionSettings = DEFAULT_SETTINGS,
    library: Sequence[type[Effect]] | None = None,
    workers: Workers | None = None,
    progress: Progress | None = None,
    folder: Path | None = None,
    time_budget: float = math.inf,
    learn_residual: bool = False,
) -> ClosedLoop:
    """Finds what a model lacks to explain its log.

    The model is fitted, every effect of the library that could act on it is judged by
    what it explains of rows that it was not fitted to, and those that are confirmed
    are added one by one. Prints nothing.

    Args:
        model: of the whole log, with the parameters that are identified anyway.
        train, test: numbers of the episodes that are fitted and held out; one that is
            left out is all that the other leaves, both are the model's default. An
            empty `test` holds out contiguous blocks in turn.
        huber_delta: residual, in standard deviations, beyond which the loss is linear;
            the model's default if left out, infinity for least squares.
        settings: thresholds.
        library: effects that may be named; all registered ones if left out.
        workers: evaluate; this process if left out.
        progress: gets a line after each step; may raise to stop.
        folder: of a cache of fits: the same call, stopped and made again, resumes.
        time_budget: after which the verdict is there, with what has been found [s];
            candidates whose turn has not come are not tested. The fit without effects
            and the errors on held-out rows take what they take.
        learn_residual: whether a model of what the effects leave is learned, which
            lowers the error and explains nothing.

    Raises:
        DisasmError: the log is too short to decide anything, or no effect of the
            library can act on the model.
    """
    deadline = time.monotonic() + _SEARCHED * time_budget
    library = registered_effects() if library is None else library
    train, test = train_and_test(
        model.measurements.names, train, test, model.held_out_share
    )
    delta = model.default_huber_delta if huber_delta is None else huber_delta
    workers = workers or Workers()
    progress = progress or ignore_progress
    written: list[Bookkeeping[LogModel]] = []
    while True:
        fitter = Fitter.of(model.of_episodes(train), workers, delta, settings, folder)
        fitter = dataclasses.replace(fitter, deadline=deadline)
        base = fitter.base
        refuse_few_rows(base)
        refuse_rest(base)
        refuse(dead_channels(base))
        applicable = _applicable(base, library)
        found = search(fitter, applicable, progress, deadline)
        better = _better_written(model, fitter, found, train, len(written), deadline)
        if better is None:
            break
        progress(ProgressUpdate("selecting effects", message=better.what))
        written.append(better)
        model = better.model
    held_out = with_noise_of(base, model.of_episodes(test)) if test else None
    errors = held_out_errors(found.first, found.last, held_out)
    is_late = time.monotonic() > deadline
    may_scatter = Imprecision in library and not is_late
    scatter = fit_command_scatter(fitter, found.last) if may_scatter else None
    misfits = [f"{each.what} ({each.remedy})" for each in contradicting_rows(base)]
    verdict = judge(found, errors, scatter, misfits, written)
    if learn_residual and not is_late:
        learned = fit_residual_model(found.last, verdict.predictable_residual, held_out)
        verdict = dataclasses.replace(verdict, residual_model=learned)
    return ClosedLoop(verdict, errors, found, scatter)


def _better_written(
    model: LogModel,
    fitter: Fitter,
    found: SearchResult,
    train: Sequence[int],
    known: int,
    deadline: float,
) -> Bookkeeping[LogModel] | None:
    """Returns how a log was written, if that explains it better than effects do."""
    if known >= _MOST_REWRITES or time.monotonic() > deadline:
        return None
    hypotheses = model.bookkeeping()
    return best_hypothesis(fitter, found, hypotheses, lambda m: m.of_episodes(train))


def _applicable(
    model: LogModel, library: Sequence[type[Effect]]
) -> Sequence[Candidate]:
    """Returns the effects of a library that could act on a model.

    Raises:
        DisasmError: there are none, so that no verdict would mean anything.
    """
    found = candidates(model, library)
    if not found and Imprecision not in library:
        raise DisasmError(
            f"{type(model).__name__}: no effect of the library can act on it; name the "
            "classes of effects that its predict applies in effect_types"
        )
    return found
