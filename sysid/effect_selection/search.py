"""Adds one effect at a time, as long as data that were not fitted get better by it."""

import dataclasses
import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sysid.effect_selection.block_regression import BlockRegression, blocks_of
from sysid.effect_selection.candidates import Candidate, extended
from sysid.effect_selection.evidence import (
    LEAST_FIELD,
    LEAST_GAIN,
    Bench,
    Evidence,
    measured,
    simplest,
    together,
)
from sysid.effect_selection.fit import Fit
from sysid.effect_selection.fit_cache import remembered
from sysid.effect_selection.prescreen import rough_fits
from sysid.effect_selection.residual_curves import curves
from sysid.identification.gauss_newton import MIN_GAIN, gauss_newton
from sysid.identification.linearisation import extend
from sysid.models.base import LogModel
from sysid.objective import Objective
from sysid.parameters import nominal_values
from sysid.workers import Workers

Array = NDArray[np.float64]

_FAR = 10.0  # times the noise: beyond that, the linear account is not asked
_PAIRS = 3  # that are fitted where nothing passes alone
_WORTH_A_FIT = 0.02  # of the loss, by its linear account
_CREEPS = 0.005  # of the loss: a fit that gets better by less is where it was
_CLEARLY = 0.5  # of the loss without an effect: no fit is needed to see its worth
_HOPELESS = 2.0  # times the least loss of rough fits
_KEEPS_UP = 0.25  # of the loss that is left
_ITERATIONS = 8
_FEW_ITERATIONS = 6  # where an evaluation takes seconds
_PAYS = 0.02  # of the objective: what an iteration is to gain there, at least
_TRIES = 4  # effects that are fitted in a round


#: Rough fits with one more effect each, by the effect's name, to begin at.
Starts = Mapping[tuple[str, ...], Fit]


@dataclass(frozen=True)
class Survey:
    """What speaks for each candidate, and for each dependence, beside a fit.

    Attributes:
        effects, dependences: the best first.
        blocks: how many there were.
        bench: what it was made of; None in a survey that is only kept as a record.
    """

    effects: list[Evidence]
    dependences: list[Evidence]
    blocks: int
    bench: Bench | None


@dataclass(frozen=True)
class Round:
    """One effect, or pair, that was added.

    Attributes:
        chosen: what was added.
        ties: others that explain as much.
        survey: from which it was chosen.
        value: of the objective, after.
    """

    chosen: Evidence
    ties: tuple[Evidence, ...]
    survey: Survey
    value: float


@dataclass
class Tracer:
    """Searches for what a model lacks.

    Each round linearises once: the fit's own derivatives are known, and each
    candidate costs one evaluation for each of its sizes. A fit begins with that
    linearisation.

    Attributes:
        base: the model, with the parameters that it has anyway.
        library: candidates.
        workers: to evaluate with.
        huber: where squares end, in units of the noise.
        tell: called with a line after each step.
        rounds: how effects were chosen.
        exact: whether derivatives are the model's own, else those of one alike.
        folder: where fits are kept, for a search that is stopped; None keeps none.
    """

    base: LogModel
    library: Sequence[Candidate]
    workers: Workers
    huber_delta: float
    tell: Callable[[str], None]
    rounds: list[Round] = field(default_factory=list)
    exact: bool = False
    folder: Path | None = None

    def forward(self, fit: Fit, survey: Survey) -> tuple[Fit, Survey]:
        """Returns the fit with all effects that pass, and the survey that ended it.

        Some effects show only together: where nothing passes alone, pairs are tried.

        Args:
            fit: without effects.
            survey: beside it.
        """
        while True:
            found = self._added(fit, survey)
            if found is None:
                return fit, survey
            fit, survey = found, self.survey(found)

    def _promising(self, fit: Fit, survey: Survey) -> list[Evidence]:
        """Returns what is worth a fit, by a linear account, the best first."""
        assert survey.bench is not None
        if not self.base.affine:
            return [e for e in survey.effects if e.gain >= _WORTH_A_FIT]
        passing = [e for e in survey.effects if e.accepted]
        if not passing and not fit.effects:
            passing = survey.bench.pairs(survey.effects)
        return passing

    def _coarse(self, fit: Fit, survey: Survey) -> tuple[Survey, Starts]:
        """Returns a survey by rough fits of each effect, and where to begin others.

        Begins are those alone that are not hopeless.
        """
        each = list({e.effects: e for e in reversed(survey.effects)}.values())
        before, rough = rough_fits(self, fit, [e.what for e in each])
        tests = len(each)
        enough = _HOPELESS * min(after.loss for after in rough)
        pairs = list(zip(each, rough, strict=True))
        found = [_confirmed(before, after, e, tests) for e, after in pairs]
        ranking = sorted(found, key=lambda e: -e.gain)
        starts = {e.effects: after for e, after in pairs if after.loss <= enough}
        return dataclasses.replace(survey, effects=ranking), starts

    def _added(self, fit: Fit, survey: Survey) -> Fit | None:
        """Returns the fit with the best that passes and keeps what it promised.

        Where effects are linear, the evidence says which passes. Else it only says
        which are worth a fit, and fits decide.
        """
        starts: Starts = {}
        if fit.value > _FAR and not self.base.affine:
            survey, starts = self._coarse(fit, survey)
        trials = self._promising(fit, survey)
        if starts:
            trials = [e for e in trials if e.effects in starts]
        passing, tried = self._tried(fit, survey, _to_try(trials), starts)
        if not passing and not self.base.affine:
            passing, _ = self._tried(fit, survey, _pairs(tried))
        if not passing:
            return None
        best, found = _lowest(passing)
        if not self.base.affine:
            again = self.fit(fit.effects, found)
            if again.loss <= (1.0 + LEAST_GAIN) * found.loss:
                self.tell(f"a better fit without more: objective {again.value:.4g}")
                return again if again.loss < (1.0 - _CREEPS) * fit.loss else None
        is_single = any(best is e for e in survey.effects)
        ties = _ties(best, survey.effects if is_single else trials)
        if not self.base.affine:
            ties = _true_ties(ties, passing, fit, found)
            found = self._settled(found)
        record = dataclasses.replace(survey, bench=None)
        self.rounds.append(Round(best, ties, record, found.value))
        self.tell(f"{best.name}: objective {found.value:.4g}")
        return found

    def _settled(self, fit: Fit) -> Fit:
        """Returns the fit at the bottom of its valley, with as few sizes as will do.

        Derivatives of a model that is alike stop short: what they leave, effects would
        explain that are not there.
        """
        tracer = self
        if self.base.costly and not self.exact and fit.value > 1.0:
            tracer = dataclasses.replace(self, exact=True)
            fit = tracer.fit(fit.effects, fit)
        return tracer.simplified(fit)

    def simplified(self, fit: Fit) -> Fit:
        """Returns the fit without sizes that gain next to nothing, even if they show.

        They have taken up what the model does a little differently from the device.
        """
        effects = tuple(self._with_worthy_sizes(fit, effect) for effect in fit.effects)
        if effects == fit.effects:
            return fit
        simple = self.fit(effects, fit)
        return simple if simple.loss <= (1.0 + LEAST_GAIN) * fit.loss else fit

    def _with_worthy_sizes(self, fit: Fit, effect: Candidate) -> Candidate:
        """Returns an effect of a fit with its best size and others that gain enough."""
        columns = fit.columns_of(effect)
        gains = fit.gains_of([np.array([c]) for c in columns])
        enough = min(LEAST_FIELD, max(gains))
        pairs = zip(effect.fields, gains, strict=True)
        return effect.only([field for field, gain in pairs if gain >= enough])

    def _tried(
        self,
        fit: Fit,
        survey: Survey,
        trials: Sequence[Evidence],
        starts: Starts | None = None,
    ) -> tuple[list[tuple[Evidence, Fit]], list[tuple[Evidence, Fit]]]:
        """Returns the fits that keep what their effects promised, and all fits."""
        passing, tried = [], []
        for trial in trials:
            start = (starts or {}).get(trial.effects)
            found = self._further(start) if start else self._with(fit, survey, trial)
            found = self._without_needless(found)
            tried.append((trial, found))
            if not self._keeps_promise(fit, found, trial):
                self.tell(f"{trial.name}: does not keep what it promised")
                continue
            passing.append((trial, found))
            if self.base.affine or (self.base.costly and found.value < 1.0):
                break
        return passing, tried

    def _keeps_promise(self, fit: Fit, found: Fit, trial: Evidence) -> bool:
        """Returns whether a fit with more effects is truly better."""
        if found.loss > (1.0 - LEAST_GAIN) * fit.loss:
            return False
        if not found.all_show(trial.effects):
            return False
        tests = len({candidate.name for candidate in self.library})
        return self.base.affine or _confirmed(fit, found, trial, tests).accepted

    def _without_needless(self, fit: Fit) -> Fit:
        """Returns the fit without effects that the newest has made needless.

        Where effects are not linear, by fits without each.
        """
        fit = self.backward(fit)
        if self.base.affine:
            return fit
        worth = fit.worth
        for effect in fit.effects[:-1]:
            if worth[effect.name] > _CLEARLY:
                continue
            rest = tuple(c for c in fit.effects if c is not effect)
            without = self.fit(rest, fit)
            if without.loss <= (1.0 + LEAST_GAIN) * fit.loss:
                self.tell(f"without {effect.text}: objective {without.value:.4g}")
                fit = without
        return fit

    def _with(self, fit: Fit, survey: Survey, chosen: Evidence) -> Fit:
        """Returns the fit with what was chosen; it begins where the survey was."""
        bench = survey.bench
        assert bench is not None and isinstance(chosen.what, tuple)
        added = bench.pruned(chosen.what)
        known = {
            f"{candidate.name}.{bench.fields[column]}": bench.linearisation.jacobian[
                ..., column
            ]
            for candidate in added
            for column in bench.groups[candidate.text]
        }
        while True:
            found = self.fit((*fit.effects, *added), fit, known)
            kept = found.physical(added)
            if kept == added or not kept:
                break
            added = kept
        moves = any(found.model.simulated[found.columns_of(c)].any() for c in added)
        done = self.base.affine or self.base.costly or not moves
        if done or found.value <= 1.0:
            return found
        # Contact hides sizes from the linear account that matter once it is away.
        full = self.fit((*fit.effects, *chosen.what), found)
        if full.loss > (1.0 - LEAST_GAIN) * found.loss:
            return found
        return self._with_what_shows(full, len(fit.effects))

    def _further(self, rough: Fit) -> Fit:
        """Returns the fit to all rows that begins at one to few of them.

        The newest effect keeps those sizes that show.
        """
        found = self.fit(rough.effects, rough)
        return self._with_what_shows(found, len(rough.effects) - 1)

    def _with_what_shows(self, fit: Fit, known: int) -> Fit:
        """Returns the fit whose effects after the known ones have sizes that show."""
        shows = fit.shows
        new = []
        for effect in fit.effects[known:]:
            columns = fit.columns_of(effect)
            pairs = zip(effect.fields, columns, strict=True)
            if fields := [field for field, c in pairs if shows[c]]:
                new.append(effect.only(fields))
        effects = (*fit.effects[:known], *new)
        return fit if not new or effects == fit.effects else self.fit(effects, fit)

    def backward(self, fit: Fit) -> Fit:
        """Returns the fit without effects that later ones have made needless."""
        while True:
            worth = fit.worth
            needless = [c for c in fit.effects if worth[c.name] < LEAST_GAIN]
            if not needless:
                return fit
            least = min(needless, key=lambda c: worth[c.name])
            fit = self.fit(tuple(c for c in fit.effects if c is not least), fit)
            self.tell(f"without {least.text}: objective {fit.value:.4g}")

    def fit(
        self,
        effects: tuple[Candidate, ...],
        start: Fit | None = None,
        known: Mapping[str, Array] | None = None,
        values: Mapping[str, float] | None = None,
    ) -> Fit:
        """Returns a model with effects, fitted.

        Args:
            effects: of the model.
            start: where to begin; what it does not have begins at null.
            known: derivatives (rows, channels) by what is new beside the start, if
                everything of the start is kept; shapes have none at null.
            values: where else to begin, by name.
        """
        model, _ = extended(self.base, effects, with_shapes=True)
        begin = (start.values if start else {}) | dict(values or {})
        theta = [begin.get(p.name, p.nominal) for p in model.parameters]
        objective = self._objective(model)
        u = objective.scaling.to_unit(np.array(theta))
        linearisation = None
        if start and known is not None:
            names = [p.name for p in model.parameters[len(start.theta) :]]
            zero = np.zeros_like(start.linearisation.residual)
            more = [known.get(name, zero) for name in names]
            jacobian = np.concatenate(
                [start.linearisation.jacobian, np.stack(more, axis=-1)], axis=-1
            )
            linearisation = dataclasses.replace(
                start.linearisation, u=u, jacobian=jacobian
            )
        most, pays = (
            (_FEW_ITERATIONS, _PAYS) if model.costly else (_ITERATIONS, MIN_GAIN)
        )
        linearisation = remembered(
            None if model.affine else self.folder,
            (model, self.huber_delta, self.exact, u, linearisation),
            lambda: gauss_newton(
                objective, u, most, start=linearisation, central=False, min_gain=pays
            ),
        )
        found = objective.scaling.from_unit(linearisation.u)
        return Fit(
            effects,
            model,
            found,
            linearisation,
            objective.value(linearisation.residual),
        )

    def _objective(self, model: LogModel) -> Objective:
        surrogate = None if self.exact else model.surrogate()
        return Objective(model, self.workers, self.huber_delta, surrogate)

    def survey(self, fit: Fit) -> Survey:
        """Returns what speaks for each candidate that the fit does not have."""
        names = {candidate.name for candidate in fit.effects}
        rest = [c for c in self.library if c.name not in names]
        bench = self._bench(fit, rest)
        effects, dependences = bench.everything([(c,) for c in rest] + together(rest))
        return Survey(effects, dependences, len(bench.regression.begins), bench)

    def _bench(self, fit: Fit, library: Sequence[Candidate]) -> Bench:
        """Returns the linearisation beside a fit, and its normal equations."""
        model, groups = extended(fit.model, library)
        count = len(fit.theta)
        objective = self._objective(model)
        rest = nominal_values(model.parameters)[count:]
        u = objective.scaling.to_unit(np.concatenate([fit.theta, rest]))
        linearisation = extend(fit.linearisation, objective, u)
        episode = model.measurements.episode
        extra, dependences = curves(model)
        blocks = blocks_of(linearisation, episode)
        raw = BlockRegression.of(linearisation, blocks, extra)
        begin = len(model.parameters)
        return Bench(
            linearisation,
            tuple(p.name.rpartition(".")[2] for p in model.parameters),
            raw,
            raw.project_out(np.arange(count)),
            {
                c.text: np.array(group, dtype=np.int64)
                for c, group in zip(library, groups, strict=True)
            },
            [(d, begin + np.array(d.columns, dtype=np.int64)) for d in dependences],
            episode[np.unique(blocks, return_index=True)[1]],
        )


def _confirmed(before: Fit, after: Fit, trial: Evidence, tests: int) -> Evidence:
    """Returns the evidence for what was added, by fits before and after.

    Each block is judged by what the fit after would cost it, were it fitted to all
    others; the p-value is for as many tests as there are effects (Bonferroni).
    """
    blocks = blocks_of(before.linearisation, before.model.measurements.episode)
    energy = before.regression(blocks).energy
    gains = energy - after.regression(blocks).losses(np.arange(len(after.theta)))
    return measured(trial, gains, float(energy.sum()), tests)


def _true_ties(
    ties: Sequence[Evidence],
    kept: Sequence[tuple[Evidence, Fit]],
    before: Fit,
    found: Fit,
) -> tuple[Evidence, ...]:
    """Returns rivals that could explain what the chosen effect truly did.

    Those that were fitted are judged by that.
    """
    limit = (1.0 + _KEEPS_UP) * found.loss
    fitted = {e.effects: fit.loss for e, fit in kept if fit is not found}
    known = {e.effects: e for e, fit in kept if fit is not found}
    for tie in ties:
        known.setdefault(tie.effects, tie)
    return tuple(
        tie
        for effects, tie in known.items()
        if fitted.get(effects, (1.0 - tie.gain) * before.loss) <= limit
    )


def _to_try(accepted: Sequence[Evidence]) -> list[Evidence]:
    """Returns the simplest of the best, then rivals of other effects by their gain."""
    found: dict[tuple[str, ...], Evidence] = {}
    if accepted:
        first = simplest(accepted)
        found[first.effects] = first
    for each in accepted:
        found.setdefault(each.effects, each)
    return list(found.values())[:_TRIES]


def _pairs(tried: Sequence[tuple[Evidence, Fit]]) -> list[Evidence]:
    """Returns pairs of what was tried alone, the best first."""
    order = sorted(tried, key=lambda pair: pair[1].loss)
    return [
        dataclasses.replace(
            first, what=(*first.what, *second.what), cost=first.cost + second.cost
        )
        for (first, _), (second, _) in itertools.combinations(order, 2)
        if isinstance(first.what, tuple) and isinstance(second.what, tuple)
    ][:_PAIRS]


def _lowest(kept: Sequence[tuple[Evidence, Fit]]) -> tuple[Evidence, Fit]:
    """Returns the first of the fits that are as good as the best."""
    least = min(fit.loss for _, fit in kept)
    return next(pair for pair in kept if pair[1].loss <= (1.0 + LEAST_GAIN) * least)


def _ties(best: Evidence, others: Sequence[Evidence]) -> tuple[Evidence, ...]:
    """Returns what passes, or gains no less, and can't be told from the best."""
    likely = [e for e in others if e.accepted or e.gain >= best.gain]
    return tuple(e for e in likely if e.ties_with(best))
