"""Selection where the model is not linear in its effects: fits decide.

The linear account at the present fit ranks the candidates; the best are fitted, and the
fits are compared by the same loss and the same rules as terms of a linear model.
Contact makes a derivative at null mean little far from the data: there every effect is
fitted to a few rows.
"""

import dataclasses
import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from drake_disasm.common.progress import Progress, ProgressUpdate, ignore_progress
from drake_disasm.effects import EnvironmentEffect
from sysid.effect_selection.exceeds_noise import exceeds_noise_p
from sysid.effect_selection.forward_selection import (
    Gain,
    Step,
    Term,
    ranked,
    step_of,
    thinned,
)
from sysid.effect_selection.linear_account import LinearAccount
from sysid.effect_selection.linear_system import LinearSystem, linear_system
from sysid.effect_selection.prescreen import prescreening_fits
from sysid.fitting.candidates import Candidate
from sysid.fitting.fit import Fit
from sysid.fitting.fitter import Fitter
from sysid.fitting.settings import SelectionSettings
from sysid.workers import Workers

_Names = tuple[str, ...]
_Gained = tuple[Gain, Fit]


@dataclass
class RefitSelection:
    """Adds effects to a model one at a time, each confirmed by a fit.

    Attributes:
        fitter: of the rows that are searched.
        library: candidates.
        progress: gets a line after each step.
        deadline: when to stop, by `time.monotonic` [s].
        steps: what was added.
        doubted: fits with an effect that would have been added, if noise or the model's
            own error could not be all of what it explains.
        begin: what each candidate would gain without effects, the best first.
        is_complete: whether it ended by itself, not because its time was over.
        invalid: why the model does not hold for the log, in words; empty if it does.
    """

    fitter: Fitter
    library: Sequence[Candidate]
    progress: Progress = ignore_progress
    deadline: float = math.inf
    steps: list[Step] = field(default_factory=list)
    doubted: list[Fit] = field(default_factory=list)
    begin: tuple[Gain, ...] = ()
    is_complete: bool = True
    invalid: str = ""

    def run(self, fit: Fit) -> Fit:
        """Returns the fit with effects that lower the held-out loss.

        Args:
            fit: without them.
        """
        for _ in range(self._settings.max_steps):
            if fit.is_at_noise and not fit.states_model_error:
                return fit
            if fit.effects and self._is_invalid(fit):
                return fit
            found = self._next(fit)
            if time.monotonic() > self.deadline:
                self.is_complete = False
                return found or fit
            if found is None:
                return fit
            fit = self._without_needless(found)
        return fit

    def _is_invalid(self, fit: Fit) -> bool:
        """Returns whether the model does not say what would be explained further."""
        found = fit.model.validity(fit.theta)
        self.invalid = "" if found is None or found.holds else str(found)
        return bool(self.invalid)

    @property
    def _settings(self) -> SelectionSettings:
        return self.fitter.settings

    def _next(self, fit: Fit) -> Fit | None:
        """Returns the fit with one more effect; None if none is confirmed."""
        self._report(f"comparing {len(self.library)} candidates")
        self.doubted = []
        system = linear_system(self.fitter, fit, self.library, self.deadline)
        if not fit.effects:
            self.begin = tuple(LinearAccount.of_fit(system, fit).gains())
        best = self._best_shapes(system)
        trials = self._trials(fit, best)
        gains = self._gained(fit, system, trials)
        if not self._reaches_noise(fit, gains):
            known = {*gains, *(trial.term.names for trial in trials)}
            others = [gain for gain in best if gain.term.names not in known]
            gains |= self._gained(fit, system, self._prescreened(fit, others))
        if not gains:
            return None
        order = sorted((gain for gain, _ in gains.values()), key=lambda g: -g.share)
        step = step_of(order, self._settings)
        if step.chosen.share < self._settings.min_gain:
            return None
        self.steps.append(step)
        self.doubted = []  # without this one
        _, found = gains[step.chosen.term.names]
        self._report(f"{step.chosen.text}: objective {found.objective:.4g}")
        return found

    def _reaches_noise(self, fit: Fit, gains: Mapping[_Names, _Gained]) -> bool:
        """Returns whether all rows together are explained, or need not be.

        What explains a part may stand for another effect, which is not linear at null.
        """
        is_over = time.monotonic() > self.deadline
        if not fit.noise_is_stated or fit.states_model_error or is_over:
            return True
        return self._is_explained([fit, *(found for _, found in gains.values())])

    def _is_explained(self, fits: Sequence[Fit]) -> bool:
        """Returns whether one of fits leaves no more than the noise that is stated."""
        level = self._settings.noise_level
        return any(f.noise_is_stated and f.objective <= level for f in fits)

    def _gained(
        self, fit: Fit, system: LinearSystem, trials: Sequence[Gain]
    ) -> dict[_Names, _Gained]:
        """Returns what fits of trials gain, those that are more than noise."""
        found = {}
        for after in self._fitted(fit, system, trials):
            gain = _gain(fit, after)
            if gain and self._exceeds_noise(fit, after):
                found[gain.term.names] = (gain, after)
            elif gain and gain.share >= self._settings.min_gain:
                self.doubted.append(after)
        return found

    def _best_shapes(self, system: LinearSystem) -> list[Gain]:
        """Returns each effect in the shape that gains most by the linear account.

        With as few amplitudes as gain most: many take up noise of few rows. But what is
        around the bolt keeps all: at null a derivative doesn't say which of them it is.
        Those that gain nothing by it come last. One that would have to be larger than
        it may be is none of them: a fit stops at the bound, where a share is all.
        """
        equations = system.equations().bounded_at_null().folds(self._settings.folds)
        gains = ranked(equations, system.terms, self._settings)
        few = [
            thinned(equations, gain, self._settings)
            for gain in gains
            if not _is_around(gain.term)
        ]
        gains = sorted([*gains, *few], key=lambda gain: -gain.share)
        one = np.ones(1)
        nothing = [Gain.of(term, one, one) for term in system.terms]
        best: dict[_Names, Gain] = {}
        for gain in [*gains, *nothing]:
            best.setdefault(gain.term.names, gain)
        return list(best.values())

    def _trials(self, fit: Fit, best: Sequence[Gain]) -> list[Gain]:
        """Returns what is fitted of effects in their best shapes, the best first.

        At null, where a bolt does not touch, a derivative by what is around it says
        little: of these all are fitted, once, if that takes seconds.
        """
        limits = self._settings
        if fit.noise_is_stated and fit.objective > limits.max_linear_objective:
            return self._prescreened(fit, best)
        least = 0.5 * limits.min_gain
        found = [gain for gain in best if gain.share >= least][: limits.trials]
        if fit.effects or self.fitter.base.costly:
            return found
        known = {gain.term.names for gain in found}
        return found + [
            gain
            for gain in best
            if _is_around(gain.term) and gain.term.names not in known
        ]

    def _prescreened(self, fit: Fit, gains: Sequence[Gain]) -> list[Gain]:
        """Returns the effects that explain most by fits to a few rows, the best first.

        Those that these rows tell from the best are kept as refuted.
        """
        self._report(f"fitting {len(gains)} candidates to a few rows")
        sets = [gain.term.candidates for gain in gains]
        before, fits = prescreening_fits(self.fitter, fit, sets, self.deadline)
        pairs = sorted(zip(gains, fits, strict=False), key=lambda pair: pair[1].loss)[
            : self._settings.trials
        ]
        self._starts = {gain.term.names: found for gain, found in pairs}
        gained = [(_gain(before, found), found) for _, found in pairs]
        of_few = [
            gain if gain and self._exceeds_noise(before, found) else None
            for gain, found in gained
        ]
        best = of_few[0] if of_few else None
        self._refuted = {
            gain.term.names
            for (gain, _), own in zip(pairs, of_few, strict=True)
            if best and not (own and own.is_ambiguous_with(best, self._settings))
        }
        return [gain for gain, _ in pairs]

    def _fitted(
        self, fit: Fit, system: LinearSystem, trials: Sequence[Gain]
    ) -> list[Fit]:
        """Returns a fit for each trial for which there is time.

        Of a model that takes long, those that are refuted are left out as soon as one
        is found that leaves nothing but noise.
        """
        jobs, refuted = [], self._refuted
        for trial in trials:
            start = self._starts.get(trial.term.names)
            derivatives = {} if start else system.derivatives(trial.term)
            added = tuple(system.candidates_of(trial.term))
            if start:
                added = start.effects[len(fit.effects) :]
            jobs.append(_TrialFit(self.fitter, fit, added, start, derivatives))
        workers = self.fitter.workers
        found: list[Fit] = []
        self._starts, self._refuted = {}, set()
        if workers.in_this_process or self.fitter.base.costly:
            for trial, job in zip(trials, jobs, strict=True):
                if time.monotonic() > self.deadline:
                    break
                if trial.term.names in refuted and self._is_explained(found):
                    continue
                found.append(job.run())
                self._report(f"{job.text}: objective {found[-1].objective:.4g}")
        elif jobs:
            found = list(workers.map(_TrialFit.run, [job.alone for job in jobs]))
        return found

    def _exceeds_noise(self, before: Fit, after: Fit) -> bool:
        """Returns whether noise and the model's own error can't explain a gain."""
        if not after.noise_is_stated:
            return True
        added = after.effects[len(before.effects) :]
        count = sum(len(candidate.fields) for candidate in added)
        tests = len({candidate.name for candidate in self.library})
        return tests * exceeds_noise_p(before, after, count) < self._settings.alpha

    def _without_needless(self, fit: Fit) -> Fit:
        """Returns the fit without effects that later ones have made needless."""
        gains = fit.effect_gains
        for effect in sorted(fit.effects, key=lambda each: gains[each.name]):
            if gains[effect.name] >= self._settings.min_gain:
                return fit
            rest = tuple(each for each in fit.effects if each is not effect)
            without = self.fitter.fit(rest, fit)
            if without.loss <= fit.loss / (1.0 - self._settings.min_gain):
                self._report(f"without {effect.text}: {without.objective:.4g}")
                self.steps = [
                    s for s in self.steps if s.chosen.term.names != (effect.name,)
                ]
                return self._without_needless(without)
        return fit

    def _report(self, text: str) -> None:
        self.progress(ProgressUpdate("selecting effects", message=text))

    _starts: dict[_Names, Fit] = field(default_factory=dict)
    _refuted: set[_Names] = field(default_factory=set)


def _gain(before: Fit, after: Fit) -> Gain | None:
    """Returns what a fit gains in blocks that it was not fitted to.

    None if no amplitude is left.
    """
    added = after.effects[len(before.effects) :]
    if not added:
        return None
    counts = [len(candidate.fields) for candidate in added]
    term = Term(added, np.arange(sum(counts)), np.repeat(np.arange(len(added)), counts))
    return Gain.of(term, before.held_out_losses, after.held_out_losses)


def _is_around(term: Term) -> bool:
    """Returns whether a term is of what is around the bolt."""
    return isinstance(term.candidates[0].effect, EnvironmentEffect)


@dataclass(frozen=True)
class _TrialFit:
    """A fit with more effects, as work for a process.

    Attributes:
        fitter: makes it.
        before: the fit without them.
        added: the effects.
        start: where it begins; None for the fit without.
        derivatives: by their amplitudes, by name.
    """

    fitter: Fitter
    before: Fit
    added: tuple[Candidate, ...]
    start: Fit | None
    derivatives: dict[str, np.ndarray]

    @property
    def text(self) -> str:
        """What is added."""
        return " and ".join(candidate.text for candidate in self.added)

    @property
    def alone(self) -> "_TrialFit":
        """The same for a process of its own, which has no workers."""
        fitter = dataclasses.replace(self.fitter, workers=Workers())
        return dataclasses.replace(self, fitter=fitter)

    def run(self) -> Fit:
        """Returns the fit, with as few amplitudes as explain about as much."""
        effects, known = (*self.before.effects, *self.added), len(self.before.effects)
        begin = self.start or self.before
        derivatives = None if self.start else self.derivatives
        fit = self.fitter.fit(effects, begin, derivatives)
        while True:
            kept = fit.without_unphysical(known)
            if kept == fit.effects or len(kept) == known:
                break
            fit = self.fitter.fit(kept, fit)
        return simplified(self.fitter, fit, known)


def simplified(fitter: Fitter, fit: Fit, known: int) -> Fit:
    """Returns the fit without amplitudes whose intervals hold null, if that is as good.

    Args:
        fitter: fits it.
        fit: with all amplitudes.
        known: number of effects that keep theirs.
    """
    away = np.abs(fit.linearisation.u - fit.null)
    which, new = away > fit.half_intervals, []
    for effect in fit.effects[known:]:
        pairs = zip(effect.fields, fit.columns_of(effect), strict=True)
        fields = [name for name, column in pairs if which[column]]
        if fields:
            new.append(effect if effect.effect.is_whole else effect.only(fields))
    effects = (*fit.effects[:known], *new)
    if not new or effects == fit.effects:
        return fit
    found = fitter.fit(effects, fit)
    most = (1.0 + fitter.settings.min_gain) * fit.loss
    return found if found.loss <= most else fit
