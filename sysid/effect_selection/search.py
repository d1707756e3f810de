"""Adds one effect at a time; where effects are linear, the evidence decides which."""

import abc
import dataclasses
import itertools
import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from drake_disasm.common.progress import Progress, ProgressUpdate, ignore_progress
from sysid.effect_selection.candidates import Candidate
from sysid.effect_selection.evidence import Evidence, most_parsimonious
from sysid.effect_selection.fit import Fit
from sysid.effect_selection.fitter import Fitter
from sysid.effect_selection.held_out import held_out_loss
from sysid.effect_selection.settings import SelectionSettings
from sysid.effect_selection.survey import Survey, survey_candidates


@dataclass(frozen=True)
class SelectionRound:
    """One effect, or pair, that was added.

    Attributes:
        chosen: what was added.
        ties: others that explain as much.
        survey: from which it was chosen.
        objective: after.
    """

    chosen: Evidence
    ties: tuple[Evidence, ...]
    survey: Survey
    objective: float


@dataclass(frozen=True)
class SearchResult:
    """What a search found.

    Attributes:
        first, last: the fits without effects and with those that were added.
        begin, end: the evidence for each candidate at both.
        rounds: how the effects were chosen.
        is_complete: whether it ended by itself, not because its time was over.
    """

    first: Fit
    last: Fit
    begin: Survey
    end: Survey
    rounds: tuple[SelectionRound, ...]
    is_complete: bool


@dataclass
class ForwardSearch(abc.ABC):
    """Adds effects to a model one at a time, as long as one is confirmed by a fit.

    Attributes:
        fitter: fits the model with chosen effects.
        library: candidates.
        progress: gets a line after each step.
        deadline: when to stop, by `time.monotonic` [s]; a fit that runs is finished,
            and candidates whose turn has not come are not tested.
    """

    stage: ClassVar[str] = "selecting effects"

    fitter: Fitter
    library: Sequence[Candidate]
    progress: Progress = ignore_progress
    deadline: float = math.inf
    _rounds: list[SelectionRound] = field(default_factory=list)

    def run(self, known: SearchResult | None = None) -> SearchResult:
        """Fits the model, and adds effects until none is confirmed any more.

        Args:
            known: of fewer rows, to go on from.
        """
        self._report("fitting the model without effects")
        fit = first = self.fitter.fit((), known.first if known else None)
        self._report_fit("without effects", first)
        self._report(f"testing {len(self.library)} candidates")
        survey = self._survey(first)
        begin = survey.record()
        if known and known.rounds:
            fit = self._all_rows_of(known)
            del survey  # one at a time: each has hundreds of columns
            survey = self._survey(fit)
        while not self._is_over:
            found = self._next(fit, survey) or self._exchanged(fit)
            if found is None:
                break
            fit = self._without_misshapen(found)
            del survey
            survey = self._survey(fit)
        rounds, is_complete = tuple(self._rounds), not self._is_over
        return SearchResult(first, fit, begin, survey, rounds, is_complete)

    def _all_rows_of(self, known: SearchResult) -> Fit:
        """Returns what fewer rows have named, fitted to all; keeps its rounds."""
        self._rounds += known.rounds
        self._report("fitting all rows")
        fit = self.fitter.fit(known.last.effects, known.last)
        self._report_fit("with what fewer rows have named", fit)
        return self._without_needless(fit)

    @property
    def _is_over(self) -> bool:
        return time.monotonic() > self.deadline

    def _survey(self, fit: Fit, library: Sequence[Candidate] | None = None) -> Survey:
        """Returns the evidence for each candidate that a fit does not have.

        Args:
            fit: without them.
            library: candidates; those that are left if left out.
        """
        wanted = self.library if library is None else library
        return survey_candidates(self.fitter, fit, wanted, self.deadline)

    @abc.abstractmethod
    def _next(self, fit: Fit, survey: Survey) -> Fit | None:
        """Returns the fit with one more effect, or pair; None if none is confirmed."""

    def _exchanged(self, fit: Fit) -> Fit | None:
        """Returns the fit with one effect in place of another, if that is better.

        When no further effect is confirmed.
        """
        return None

    @property
    def _settings(self) -> SelectionSettings:
        return self.fitter.settings

    def _report(self, text: str) -> None:
        self.progress(ProgressUpdate(self.stage, message=text))

    def _report_fit(self, text: str, fit: Fit) -> None:
        line = f"{text}: objective {fit.objective:.4g}"
        self.progress(ProgressUpdate(self.stage, message=line, value=fit.objective))

    def _record(
        self, chosen: Evidence, ties: Sequence[Evidence], survey: Survey, fit: Fit
    ) -> None:
        """Keeps what was added and why."""
        self._rounds.append(
            SelectionRound(chosen, tuple(ties), survey.record(), fit.objective)
        )
        self._report_fit(chosen.name, fit)

    def _fit_chosen(self, fit: Fit, survey: Survey, chosen: Evidence) -> Fit:
        """Returns the fit with what was chosen, from the survey's derivatives on.

        Amplitudes that no block needs or that end at a bound are left out.
        """
        linear = survey.linearised
        added = linear.pruned(chosen.candidates)
        return self._fit_added(fit, added, linear.derivatives(added))

    def _fit_added(
        self,
        fit: Fit,
        added: Sequence[Candidate],
        derivatives: Mapping[str, NDArray[np.float64]],
    ) -> Fit:
        """Returns the fit with more effects, without amplitudes that end at a bound.

        Args:
            fit: without them.
            added: the effects.
            derivatives: (rows, channels) by their amplitudes, by name.
        """
        while True:
            found = self.fitter.fit((*fit.effects, *added), fit, derivatives)
            kept = found.within_bounds(added)
            if kept == list(added) or not kept:
                return found
            added = kept

    def _without_needless(self, fit: Fit) -> Fit:
        """Returns the fit without effects that later ones have made needless.

        By the linear account, which a fit without has to confirm: the derivative of a
        wall says nothing of what an effect is worth.
        """
        limit, gains = self._settings.min_gain, fit.effect_gains
        for effect in sorted(fit.effects, key=lambda c: gains[c.name]):
            if gains[effect.name] >= limit:
                return fit
            without = self._fit_without(fit, effect)
            if without.loss <= fit.loss / (1.0 - limit):
                self._report_fit(f"without {effect.text}", without)
                return self._without_needless(without)
        return fit

    def _without_misshapen(self, fit: Fit) -> Fit:
        """Returns the fit without effects that later ones have driven to a bound.

        They stood for those, and are no candidates any more.
        """
        for effect in fit.effects:
            names = [effect.name]
            if not (fit.at_bound(names) or fit.is_misshapen(names)):
                continue
            self.library = [c for c in self.library if c.name != effect.name]
            self._report(f"{effect.name}: removed, since it has come to a bound")
            return self._without_misshapen(self._fit_without(fit, effect))
        return fit

    def _fit_without(self, fit: Fit, effect: Candidate) -> Fit:
        """Returns a fit without one of its effects."""
        return self.fitter.fit(tuple(c for c in fit.effects if c is not effect), fit)

    def _is_better(self, before: Fit, after: Fit, trial: Evidence) -> bool:
        """Returns whether the loss falls, and a trial's effects make sense.

        They are significant, no amplitude ends at a bound, nor a shape that would go
        further, and no channel pays.
        """
        if after.loss > (1.0 - self._settings.min_gain) * before.loss:
            return False
        if after.at_bound(trial.effects) or after.harmed_channels(before):
            return False
        if after.is_misshapen(trial.effects):
            return False
        return after.all_significant(trial.effects)

    def _report_rejected(self, trial: Evidence) -> None:
        self._report(
            f"{trial.name}: rejected: the refit does not confirm the predicted gain"
        )


@dataclass
class LinearSearch(ForwardSearch):
    """Where a model is affine in its effects: the evidence is exact, up to the noise.

    The first accepted candidate that its fit confirms is added. Gains of the survey
    are of blocks to which the effect was not fitted, but all other parameters were:
    what is added has to lower the loss of blocks to which nothing was, too.
    """

    _replaced: set[tuple[str, ...]] = field(default_factory=set)
    _whole_library: Sequence[Candidate] = field(init=False)

    def __post_init__(self) -> None:
        """Keeps the library as it is at the begin."""
        self._whole_library = self.library

    def _next(self, fit: Fit, survey: Survey) -> Fit | None:
        accepted = [e for e in survey.effects if e.accepted]
        if not accepted and not fit.effects:
            accepted = survey.linearised.accepted_pairs(survey.effects)
        if not accepted:
            return None
        for trial in trials(accepted, self._settings.max_trials):
            found = self._without_needless(self._fit_chosen(fit, survey, trial))
            if self._is_confirmed(fit, found, trial):
                rivals = linear_rivals(trial, survey, accepted)
                self._record(trial, ties(trial, rivals), survey, found)
                return found
            self._report_rejected(trial)
            if self._is_over:
                break
        return None

    def _exchanged(self, fit: Fit) -> Fit | None:
        """See ForwardSearch. Ties are found anew of effects that stay.

        What was chosen while others were missing may have stood for those in part, or
        for two of them. What has been exchanged does not come back in this way.
        """
        for number, past in enumerate(self._rounds):
            added = [e for e in fit.effects if (e.name,) == past.chosen.effects]
            if not added or self._is_over:
                continue
            (effect,) = added
            self._report(f"{effect.name}: comparing it with what could be in its place")
            without = self._fit_without(fit, effect)
            survey = self._survey(without, self._whole_library)
            own = next((e for e in survey.effects if e.effects == (effect.name,)), None)
            if own is None:
                continue
            rivals = linear_rivals(own, survey, [])
            past = dataclasses.replace(past, ties=ties(own, rivals))
            self._rounds[number] = past
            trial = self._simplest(own, survey)
            if trial is own:
                continue
            found = self._fit_chosen(without, survey, trial)
            if self._is_as_good(fit, without, found, trial):
                self._replace([past], trial, ties(trial, rivals), survey, found)
                return found
        return self._united(fit)

    def _united(self, fit: Fit) -> Fit | None:
        """Returns the fit with one effect in place of several that it is a rival of.

        Several may stand for one that is missing: ripples of two joints, that were
        chosen as a group or one by one, for the torque of one that comes late.
        """
        have = {effect.name for effect in fit.effects}
        alone = [past for past in self._rounds if len(_present(past, fit)) == 1]
        groups = [(past,) for past in self._rounds if len(_present(past, fit)) > 1]
        for rounds in [*groups, *itertools.combinations(alone, 2)]:
            gone = [name for past in rounds for name in _present(past, fit)]
            shared = set.intersection(*({e.effects for e in r.ties} for r in rounds))
            shared = {
                names
                for names in shared - self._replaced
                if len(names) < len(gone) and not have & {*names}
            }
            if not shared or self._is_over:
                continue
            self._report(
                f"{' and '.join(gone)}: comparing them with one in their place"
            )
            kept = tuple(effect for effect in fit.effects if effect.name not in gone)
            without = self.fitter.fit(kept, fit)
            survey = self._survey(without, self._whole_library)
            accepted = [e for e in survey.effects if e.accepted]
            tried = trials(accepted, len(accepted))
            for trial in (each for each in tried if each.effects in shared):
                found = self._fit_chosen(without, survey, trial)
                if self._is_as_good(fit, without, found, trial):
                    rivals = linear_rivals(trial, survey, [])
                    self._replace(rounds, trial, ties(trial, rivals), survey, found)
                    return found
        return None

    def _is_as_good(self, fit: Fit, without: Fit, found: Fit, trial: Evidence) -> bool:
        """Returns whether what is in another's place explains nearly as much."""
        share = self._settings.tie_parsimony_tolerance
        enough = fit.loss + share * (without.loss - fit.loss)
        return found.loss <= enough and self._is_confirmed(without, found, trial)

    def _replace(
        self,
        gone: Sequence[SelectionRound],
        trial: Evidence,
        others: Sequence[Evidence],
        survey: Survey,
        found: Fit,
    ) -> None:
        """Keeps what has taken the place of what some rounds added."""
        self._replaced |= {past.chosen.effects for past in gone}
        self._rounds = [r for r in self._rounds if not any(r is past for past in gone)]
        self._record(trial, others, survey, found)

    def _is_confirmed(self, before: Fit, after: Fit, trial: Evidence) -> bool:
        """Returns whether it is better, of rows to which nothing is fitted, too."""
        if not self._is_better(before, after, trial):
            return False
        enough = (1.0 - self._settings.min_gain) * held_out_loss(before)
        return held_out_loss(after) <= enough

    def _simplest(self, own: Evidence, survey: Survey) -> Evidence:
        """Returns what is chosen of an effect, and others or pairs in its place."""
        singles = [e for e in survey.effects if e.accepted]
        pairs = survey.linearised.accepted_pairs(survey.effects)
        known = {own.effects, *self._replaced}
        others = [
            e
            for e in [*singles, *pairs]
            if e.effects not in known and not set(own.effects) <= set(e.effects)
        ]
        return most_parsimonious(sorted([own, *others], key=lambda e: -e.gain))


def _present(past: SelectionRound, fit: Fit) -> list[str]:
    """Returns the names of what a round added that a fit still has."""
    return [e.name for e in fit.effects if e.name in past.chosen.effects]


def trials(accepted: Sequence[Evidence], count: int) -> list[Evidence]:
    """Returns what to fit: the most parsimonious of the best, then others by gain.

    Args:
        accepted: the best first; each effect is tried in its best shape.
        count: at most.
    """
    found: dict[tuple[str, ...], Evidence] = {}
    if accepted:
        first = most_parsimonious(accepted)
        found[first.effects] = first
    for each in accepted:
        found.setdefault(each.effects, each)
    return list(found.values())[:count]


def ties(best: Evidence, rivals: Sequence[Evidence]) -> tuple[Evidence, ...]:
    """Returns the rivals that the blocks can't distinguish from what was chosen."""
    return tuple(e for e in rivals if e.ties_with(best))


def linear_rivals(
    best: Evidence, survey: Survey, accepted: Sequence[Evidence]
) -> list[Evidence]:
    """Returns what is accepted, or gains no less than what was chosen.

    Args:
        best: what was chosen.
        survey: where its rivals are, if it is in there.
        accepted: its rivals else, as of a pair.
    """
    is_surveyed = any(best is e for e in survey.effects)
    rivals = survey.effects if is_surveyed else accepted
    return [e for e in rivals if e.accepted or e.gain >= best.gain]
