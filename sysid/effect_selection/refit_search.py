"""Adds one effect at a time; where effects are not linear, fits decide which.

The linear ranking of a survey only selects which candidates are worth a fit. Far from
the data it is of no use: there every effect is fitted to a few rows (`prescreen`).
"""

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from typing import Self

import numpy as np
from numpy.typing import NDArray

from drake_disasm.common.progress import ProgressUpdate, ignore_progress
from sysid.effect_selection.candidates import Candidate
from sysid.effect_selection.evidence import Evidence
from sysid.effect_selection.fit import Fit
from sysid.effect_selection.measured_evidence import (
    linear_p,
    measured_evidence,
)
from sysid.effect_selection.prescreen import prescreening_fits
from sysid.effect_selection.search import ForwardSearch, ties, trials
from sysid.effect_selection.simplification import (
    at_own_minimum,
    with_significant_only,
    without_noise,
)
from sysid.effect_selection.survey import Survey
from sysid.effect_selection.trial_comparison import (
    Trial,
    as_good_as_the_best,
    pairs_of,
    ties_by_fit,
)
from sysid.workers import Workers

#: Fits with one more effect each, by the names of the effects, to start from.
_Starts = Mapping[tuple[str, ...], Fit]


@dataclasses.dataclass(frozen=True)
class _Ranking:
    """Effects in the order of what they promise, and what fits made of the first.

    Attributes:
        survey: with the evidence for each.
        likely: that are worth a fit.
        confirmed: by their fits.
        tried: all that were fitted.
    """

    survey: Survey
    likely: list[Evidence]
    confirmed: list[Trial]
    tried: list[Trial]


class RefitSearch(ForwardSearch):
    """Where effects are not linear: candidates are compared by their fits."""

    def _next(self, fit: Fit, survey: Survey) -> Fit | None:
        rankings = list[_Ranking]()
        is_near = fit.objective <= self._settings.max_linear_objective
        if is_near or not fit.model.makes_contact:
            rankings.append(self._tried(fit, survey, {}))
        if self._needs_prescreening(fit, survey, rankings):
            rankings.append(self._tried(fit, *self._prescreened(fit, survey)))
        is_left = fit.objective > self._settings.noise_level
        is_left = is_left or not fit.states_model_error
        if rankings and is_left and not any(r.confirmed for r in rankings):
            rankings.append(self._tried_in_pairs(fit, rankings.pop()))
        return self._chosen(fit, [r for r in rankings if r.confirmed])

    def _needs_prescreening(
        self, fit: Fit, survey: Survey, rankings: Sequence[_Ranking]
    ) -> bool:
        """Returns whether every effect is to be fitted to a few rows.

        What is not linear at null, as a stop that takes up a force, hides from the
        linear account, which may be content with an effect that explains a little.
        Where the model states an error of its own, also with one that ends below it and
        is not what is missing; and the residual may be below it, too, and yet halved by
        what is.
        """
        if self._is_over or not survey.effects or not fit.model.makes_contact:
            return False
        if not rankings:
            return True
        is_confirmed = bool(rankings[-1].confirmed)
        is_more = fit.worst_channel > self._settings.max_objective_at_noise
        if fit.states_model_error:
            return is_confirmed or is_more
        left = min([fit.loss, *(found.loss for _, found in rankings[-1].confirmed)])
        is_little = left > (1.0 - self._settings.prescreen_below_gain) * fit.loss
        # Of a costly model more than noise is always left, and minutes would be lost.
        return is_more and is_little and not fit.model.costly

    def _tried(self, fit: Fit, survey: Survey, starts: _Starts) -> _Ranking:
        """Returns a ranking's most promising effects, with their fits."""
        likely = self._worth_a_fit(fit, survey, starts)
        chosen = trials(likely, self._settings.max_trials)
        return _Ranking(survey, likely, *self._try(fit, survey, chosen, starts))

    def _tried_in_pairs(self, fit: Fit, alone: _Ranking) -> _Ranking:
        """Returns a ranking none of whose effects is confirmed alone, by pairs."""
        pairs = pairs_of(alone.tried, self._settings)
        return _Ranking(
            alone.survey, alone.likely, *self._try(fit, alone.survey, pairs, {})
        )

    def _worth_a_fit(self, fit: Fit, survey: Survey, starts: _Starts) -> list[Evidence]:
        """Returns what gains enough; after prescreening, of what has a start alone.

        And what may exceed the model's own error, where that is stated.
        """
        if starts:
            return [e for e in survey.effects if e.effects in starts]
        limits = self._settings
        likely = [e for e in survey.effects if e.gain >= limits.refit_min_linear_gain]
        if not fit.states_model_error:
            return likely
        most = limits.refit_max_linear_p
        return [e for e in likely if linear_p(fit, survey.linearised, e) < most]

    def _chosen(self, fit: Fit, rankings: Sequence[_Ranking]) -> Fit | None:
        """Returns the best of the confirmed fits, on record, if an effect is needed."""
        if not rankings:
            return None
        limits = self._settings
        confirmed = [trial for ranking in rankings for trial in ranking.confirmed]
        best, found = as_good_as_the_best(confirmed, fit)
        ranking = next(r for r in rankings if any(e is best for e, _ in r.confirmed))
        again = self.fitter.fit(fit.effects, found)
        if again.loss <= (1.0 + limits.min_gain) * found.loss:
            return self._same_effects(fit, again)
        rivals = ties(best, ranking.likely)
        rivals = ties_by_fit(best, rivals, confirmed, fit, found)
        found = at_own_minimum(self.fitter, found)
        self._record(best, rivals, ranking.survey, found)
        return found

    def _same_effects(self, fit: Fit, again: Fit) -> Fit | None:
        """Returns a second fit of the same effects, if it is truly better; else None.

        No effect was missing: the first fit had ended in a worse minimum.
        """
        self._report_fit("a better fit without another effect", again)
        least = (1.0 - self._settings.refit_min_progress) * fit.loss
        return again if again.loss < least else None

    def _prescreened(
        self, fit: Fit, survey: Survey
    ) -> tuple[Survey, dict[tuple[str, ...], Fit]]:
        """Returns a survey by fits of each effect to a few rows, and where to start.

        Starts are those alone whose loss is near the least.
        """
        each = list({e.effects: e for e in reversed(survey.effects)}.values())
        sets = [e.candidates for e in each]
        before, fits = prescreening_fits(self.fitter, fit, sets, self.deadline)
        limit = self._settings.prescreen_max_loss_ratio * min(f.loss for f in fits)
        pairs = list(zip(each, fits, strict=False))  # the time may not be enough
        found = [
            measured_evidence(before, after, e, tests=len(each)) for e, after in pairs
        ]
        ranking = sorted(found, key=lambda e: -e.gain)
        starts = {e.effects: after for e, after in pairs if after.loss <= limit}
        return dataclasses.replace(survey, effects=ranking), starts

    def _try(
        self, fit: Fit, survey: Survey, chosen: Sequence[Evidence], starts: _Starts
    ) -> tuple[list[Trial], list[Trial]]:
        """Returns the trials that their fits confirm, and all trials, with fits."""
        confirmed, tried = [], []
        jobs = [_TrialFit.of(self, fit, survey, e, starts) for e in chosen]
        for job, outcome in zip(jobs, self._outcomes(jobs), strict=False):
            for update in outcome.updates:
                self.progress(update)
            found = outcome.fit
            tried.append((job.trial, found))
            if not outcome.is_confirmed:
                continue
            confirmed.append((job.trial, found))
            # A model that states an error of its own may be below that and wrong.
            at_noise = found.objective < self._settings.noise_level
            if found.model.costly and at_noise and not found.states_model_error:
                break
        return confirmed, tried

    def _outcomes(self, jobs: Sequence["_TrialFit"]) -> Iterator["_Outcome"]:
        """Yields what comes of trials, as long as there is time.

        They are fitted side by side; one after the other where the workers are needed
        for the simulations of each.
        """
        workers = self.fitter.workers
        if workers.in_this_process or self.fitter.base.costly:
            for job in jobs:
                if self._is_over:
                    return
                yield job.run()
        elif not self._is_over:
            yield from workers.map(_TrialFit.run, [job.alone for job in jobs])

    def trial_fit(self, job: "_TrialFit") -> tuple[Fit, bool]:
        """Returns a fit to all rows with what is tried, and whether it is confirmed.

        One that is confirmed is without the effects that it replaces.
        """
        fit = job.fit
        if job.start:
            found = self.fitter.fit(job.start.effects, job.start)
            found = with_significant_only(self.fitter, found, len(found.effects) - 1)
        else:
            found = self._fit_added(fit, job.added, job.derivatives)
            found = self._with_hidden_amplitudes(fit, found, job.trial)
        if fit.states_model_error:
            found = without_noise(self.fitter, found)
        found = self._without_needless(found)
        if not self._is_confirmed(fit, found, job.trial):
            self._report_rejected(job.trial)
            return found, False
        return self._without_replaced(fit, found, job.trial), True

    def _with_hidden_amplitudes(self, fit: Fit, found: Fit, trial: Evidence) -> Fit:
        """Returns the fit with amplitudes that the survey left out, if they help.

        Contact hides some from the linear account that matter once it is gone.
        """
        added = found.effects[len(fit.effects) :]
        simulated = found.model.simulated
        is_simulated = any(simulated[found.columns_of(c)].any() for c in added)
        at_noise = found.objective <= self._settings.noise_level
        if found.model.costly or not is_simulated or at_noise:
            return found
        full = self.fitter.fit((*fit.effects, *trial.candidates), found)
        if full.loss > (1.0 - self._settings.min_gain) * found.loss:
            return found
        return with_significant_only(self.fitter, full, len(fit.effects))

    def _is_confirmed(self, before: Fit, after: Fit, trial: Evidence) -> bool:
        """Returns whether blocks that are not fitted are predicted better."""
        if not self._is_better(before, after, trial):
            return False
        tests = len({candidate.name for candidate in self.library})
        return measured_evidence(before, after, trial, tests).accepted

    def _without_replaced(self, before: Fit, fit: Fit, trial: Evidence) -> Fit:
        """Returns the fit without effects that a confirmed one replaces.

        By fits without, each of which takes as long as the trial did: what was
        rejected is not asked.
        """
        limits, gains = self._settings, fit.effect_gains
        for effect in fit.effects[:-1]:
            if gains[effect.name] > limits.clearly_needed_gain:
                continue
            without = self._fit_without(fit, effect)
            is_as_good = without.loss <= (1.0 + limits.min_gain) * fit.loss
            if is_as_good and self._is_confirmed(before, without, trial):
                self._report_fit(f"without {effect.text}", without)
                fit = without
        return fit


@dataclasses.dataclass(frozen=True)
class _Outcome:
    """What came of a trial: its fit, whether that confirms it, and what to tell."""

    fit: Fit
    is_confirmed: bool
    updates: list[ProgressUpdate]


@dataclasses.dataclass(frozen=True)
class _TrialFit:
    """A fit with what is tried, as work for a process.

    Attributes:
        search: that tries it.
        fit: without it.
        trial: what is tried.
        start: where its fit begins, if that is known; else
        added: its effects, as pruned by a survey, and
        derivatives: (rows, channels) by their amplitudes, by name.
    """

    search: RefitSearch
    fit: Fit
    trial: Evidence
    start: Fit | None
    added: Sequence[Candidate] = ()
    derivatives: Mapping[str, NDArray[np.float64]] = dataclasses.field(
        default_factory=dict
    )

    @classmethod
    def of(
        cls,
        search: RefitSearch,
        fit: Fit,
        survey: Survey,
        trial: Evidence,
        starts: _Starts,
    ) -> Self:
        """Returns the fit of a trial, from where a prescreening fit ended, if any."""
        if start := starts.get(trial.effects):
            return cls(search, fit, trial, start)
        added = survey.linearised.pruned(trial.candidates)
        derivatives = survey.linearised.derivatives(added)
        return cls(search, fit, trial, None, added, derivatives)

    @property
    def alone(self) -> Self:
        """The same for a process of its own, which has no workers."""
        fitter = dataclasses.replace(self.search.fitter, workers=Workers())
        search = dataclasses.replace(
            self.search, fitter=fitter, progress=ignore_progress, _rounds=[]
        )
        return dataclasses.replace(self, search=search)

    def run(self) -> _Outcome:
        """Returns what comes of it."""
        updates: list[ProgressUpdate] = []
        search = dataclasses.replace(self.search, progress=updates.append)
        return _Outcome(*search.trial_fit(self), updates)
