"""Forward selection of effects: one loss, one rule for ties, one for stopping.

The loss is that of contiguous blocks of rows, each predicted with coefficients that
were fitted to the others. In each step the candidate that lowers it most is added; of
those that are about as good, the one with the fewest coefficients.
"""

import dataclasses
import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as t_distribution
from scipy.stats import wilcoxon

from sysid.fitting.block_grams import (
    Array,
    BlockGrams,
    Columns,
    NormalEquations,
)
from sysid.fitting.candidates import Candidate, kind_text
from sysid.fitting.settings import SelectionSettings


@dataclass(frozen=True)
class Term:
    """Effects that enter a model together: one, or one kind at all joints.

    Attributes:
        candidates: the effects.
        columns: (k,) of their amplitudes.
        owners: (k,) number of the candidate that each column is of.
    """

    candidates: tuple[Candidate, ...]
    columns: Columns
    owners: NDArray[np.int64]

    @property
    def names(self) -> tuple[str, ...]:
        """Of the effects, whatever their shapes."""
        return tuple(candidate.name for candidate in self.candidates)

    @property
    def kind(self) -> str:
        """Name of the effects' class."""
        return type(self.candidates[0].effect).__name__

    def of_columns(self, columns: Columns) -> "Term":
        """Returns the same with some of its columns, and effects that have any."""
        kept = np.isin(self.columns, columns)
        numbers, owners = np.unique(self.owners[kept], return_inverse=True)
        candidates = tuple(self.candidates[i] for i in numbers)
        return Term(candidates, self.columns[kept], owners)

    def of_name(self, name: str) -> Columns:
        """Returns the columns of one of its effects."""
        number = self.names.index(name)
        return self.columns[self.owners == number]


@dataclass(frozen=True)
class Gain:
    """What a term takes away of the loss of blocks that were not fitted.

    Attributes:
        term: with the columns that can help.
        of_blocks: (F,) of each fold's loss, in units of the loss of all.
        room: see `room`, in the same units.
    """

    term: Term
    of_blocks: Array
    room: float

    @classmethod
    def of(cls, term: Term, before: Array, after: Array) -> "Gain":
        """Returns the gain of a term by losses before and with it.

        Args:
            term: that is added.
            before, after: (F,) of folds, or (F, C) of folds and channels.
        """
        whole = max(float(before.sum()), 1e-300)
        taken, left = (before - after) / whole, after / whole
        of_blocks = taken.reshape(len(taken), -1).sum(axis=1)
        return cls(term, of_blocks, room(taken, left))

    @property
    def share(self) -> float:
        """Of the loss."""
        return float(self.of_blocks.sum())

    @property
    def text(self) -> str:
        """The effects, with the values of their shapes."""
        first, *rest = self.term.candidates
        if not rest:
            return first.text
        return f"{kind_text(first)} of {len(rest) + 1} joints"

    def is_about_as_good_as(self, best: "Gain", settings: SelectionSettings) -> bool:
        """Returns whether it gains and leaves nearly as much as another, the best."""
        return self.share >= best.share - settings.ambiguity_margin * best.room

    def is_ambiguous_with(self, other: "Gain", settings: SelectionSettings) -> bool:
        """Returns whether folds can't distinguish this, which gains less, from another.

        Because it gains nearly as much, or more in so many folds that the difference is
        chance (one-sided signed-rank test, Wilcoxon 1945: a fold may show an effect
        more than others do, as a long one shows a drift).
        """
        if self.is_about_as_good_as(other, settings):
            return True
        if self.share < settings.ambiguity_least * other.share:
            return False
        difference = other.of_blocks - self.of_blocks
        return bool(wilcoxon(difference, alternative="greater").pvalue > settings.alpha)


def room(taken: Array, left: Array) -> float:
    """Returns what is taken away of a loss or what is left, whichever is less.

    Fold by fold, and channel by channel where those are known: what no effect explains
    in one says nothing of what explains another.

    Args:
        taken: (F,) of each fold's loss, or (F, C) of each channel's in it.
        left: of it.
    """
    return float(np.minimum(taken, left).clip(0.0).sum())


@dataclass(frozen=True)
class Step:
    """A term that was added, and others that would have gained about as much.

    Attributes:
        chosen: what was added.
        rivals: effects of another kind or place, the best first.
    """

    chosen: Gain
    rivals: tuple[Gain, ...]


@dataclass(frozen=True)
class Selection:
    """Effects that lower the loss of blocks that were not fitted.

    Attributes:
        steps: in the order in which they were added.
        columns: of the base, and of the effects.
        weights: (channels,) of the channels in the loss.
    """

    steps: tuple[Step, ...]
    columns: Columns
    weights: Array

    @property
    def terms(self) -> tuple[Term, ...]:
        """What was added."""
        return tuple(step.chosen.term for step in self.steps)

    @property
    def names(self) -> tuple[str, ...]:
        """Of the effects, in the order in which they were added."""
        each = itertools.chain.from_iterable(term.names for term in self.terms)
        return tuple(dict.fromkeys(each))


def select(
    grams: BlockGrams,
    base: Columns,
    terms: Sequence[Term],
    settings: SelectionSettings,
    weights: Array | None = None,
    groups: Sequence[int] | None = None,
) -> Selection:
    """Returns the effects that lower the held-out loss.

    Args:
        grams: of all columns, by blocks.
        base: columns of the model without effects, which are in any case.
        terms: that may be added.
        settings: thresholds.
        weights: (channels,) in the loss, where the noise is stated. Otherwise each
            channel is divided by what is left of it: first without effects, then with
            those that are selected so.
        groups: label of each channel; those of one label have one unknown noise.
    """
    if weights is not None:
        return _selected(grams, base, terms, settings, weights)
    columns = base
    for _ in range(settings.reweightings):
        weights = channel_weights(grams, columns, groups)
        found = _selected(grams, base, terms, settings, weights)
        columns = found.columns
    return found


def channel_weights(
    grams: BlockGrams, columns: Columns, groups: Sequence[int] | None
) -> Array:
    """Returns the weight (channels,) that makes what columns leave of unit power."""
    power = grams.channel_powers(columns)
    labels = np.arange(len(power)) if groups is None else np.array(groups)
    pooled = np.array([power[labels == label].mean() for label in labels])
    return np.asarray(1.0 / np.maximum(pooled, 1e-12 * pooled.max() + 1e-300))


def _selected(
    grams: BlockGrams,
    base: Columns,
    terms: Sequence[Term],
    settings: SelectionSettings,
    weights: Array,
) -> Selection:
    """Returns the effects that lower the loss with given weights of channels."""
    whole = grams.weighted(weights)
    folds = whole.folds(settings.folds).projected(base)
    steps = list(_forward(folds, terms, settings))
    steps = _exchanged(folds, steps, terms, settings)
    kept = significant_columns(
        whole, base, [step.chosen.term for step in steps], settings
    )
    steps = [
        Step(dataclasses.replace(s.chosen, term=term), s.rivals)
        for s in steps
        if len((term := s.chosen.term.of_columns(kept)).columns)
    ]
    return Selection(tuple(steps), np.append(base, kept), weights)


def _forward(
    equations: NormalEquations, terms: Sequence[Term], settings: SelectionSettings
) -> Iterator[Step]:
    """Yields what is added, step by step."""
    steps: list[Step] = []
    while len(steps) < settings.max_steps:
        gains = ranked(equations, _others(terms, steps), settings)
        if not gains or gains[0].share < settings.min_gain:
            return
        step = step_of(gains, settings, equations)
        yield step
        steps.append(step)
        equations = equations.projected(step.chosen.term.columns)


def step_of(
    gains: Sequence[Gain],
    settings: SelectionSettings,
    equations: NormalEquations | None = None,
) -> Step:
    """Returns the simplest of the best, and its rivals.

    Args:
        gains: the best first.
        settings: thresholds.
        equations: by folds, in which an effect can do with fewer columns; None where a
            fit has left those out that it can do without.
    """
    best = gains[0]
    as_good = [gain for gain in gains if gain.is_about_as_good_as(best, settings)]
    if equations is not None:
        as_good = [thinned(equations, gain, settings) for gain in as_good]
        best = max(as_good, key=lambda gain: gain.share)
        as_good = [gain for gain in as_good if gain.is_about_as_good_as(best, settings)]
    chosen = min(as_good, key=lambda gain: (len(gain.term.columns), -gain.share))
    return Step(chosen, rivals_of(chosen, gains, settings))


def thinned(
    equations: NormalEquations, gain: Gain, settings: SelectionSettings
) -> Gain:
    """Returns the gain of an effect with those columns that lower the loss.

    Columns are added one by one, the best first, as effects are: those of an effect may
    depend on each other. Kinds at all joints stay whole, and so do bodies: a first
    moment without a mass is none.

    Args:
        equations: by folds.
        gain: of the effect with all its columns.
        settings: thresholds.
    """
    columns = gain.term.columns
    one, *others = gain.term.candidates
    if len(columns) < 2 or others or one.effect.is_whole:
        return gain
    before = equations.losses
    kept, least = np.array([], dtype=np.int64), before
    while len(kept) < len(columns):
        rest = np.setdiff1d(columns, kept)
        sets = [np.append(kept, column) for column in rest]
        losses = [equations.held_out(each) for each in sets]
        number = int(np.argmin([each.sum() for each in losses]))
        enough = (1.0 - settings.min_gain) * least.sum()
        if len(kept) and losses[number].sum() > enough:
            break
        kept, least = sets[number], losses[number]
    return Gain.of(gain.term.of_columns(kept), before, least)


def rivals_of(
    chosen: Gain, gains: Sequence[Gain], settings: SelectionSettings
) -> tuple[Gain, ...]:
    """Returns effects of another kind or place that explain about as much."""
    found: dict[tuple[str, ...], Gain] = {}
    for gain in gains:
        if gain.term.kind == chosen.term.kind and (
            set(gain.term.names) & set(chosen.term.names)
        ):
            continue
        if gain.is_ambiguous_with(chosen, settings):
            found.setdefault(gain.term.names, gain)
    return tuple(found.values())


def _exchanged(
    equations: NormalEquations,
    steps: list[Step],
    terms: Sequence[Term],
    settings: SelectionSettings,
) -> list[Step]:
    """Returns the steps, each judged again with all the others in the model.

    What was added while others were missing may have stood for those in part: it goes
    if it gains too little beside them, and gives way to what gains more.
    """
    kept: list[Step] = []
    for number, step in enumerate(steps):
        others = kept + steps[number + 1 :]
        left = equations.projected(_columns_of(others))
        gains = ranked(left, _others(terms, others), settings)
        own = ranked(left, [step.chosen.term], settings)
        gains = sorted([*own, *gains], key=lambda gain: -gain.share)
        if not gains or gains[0].share < settings.min_gain:
            continue
        best = step_of(gains, settings, left)
        if own and own[0].is_about_as_good_as(best.chosen, settings):
            best = Step(own[0], rivals_of(own[0], gains, settings))
        kept.append(best)
    return kept


def _columns_of(steps: Sequence[Step]) -> Columns:
    empty = np.array([], dtype=np.int64)
    return np.unique(np.concatenate([empty, *(s.chosen.term.columns for s in steps)]))


def _others(terms: Sequence[Term], steps: Sequence[Step]) -> list[Term]:
    """Returns terms without columns that steps have added.

    And without other shapes of effects that they have added.
    """
    chosen = {
        candidate.name: candidate.text
        for step in steps
        for candidate in step.chosen.term.candidates
    }
    if not chosen:
        return list(terms)
    added, found = _columns_of(steps), []
    for term in terms:
        texts = [chosen.get(c.name, c.text) == c.text for c in term.candidates]
        is_open = np.array(texts)[term.owners] & ~np.isin(term.columns, added)
        if is_open.all():
            found.append(term)
        elif is_open.any():
            found.append(term.of_columns(term.columns[is_open]))
    return found


def ranked(
    equations: NormalEquations, terms: Sequence[Term], settings: SelectionSettings
) -> list[Gain]:
    """Returns what terms gain, the best first; those that can't help are left out."""
    folds = equations.folds(settings.folds)
    before = folds.losses
    each = folds.held_out_each()
    found = []
    for term in terms:
        columns = _without_parts(term, folds.feasible(term.columns))
        if not len(columns):
            continue
        single = len(columns) == 1
        after = each[:, columns[0]] if single else folds.held_out(columns)
        found.append(Gain.of(term.of_columns(columns), before, after))
    return sorted(found, key=lambda gain: -gain.share)


def _without_parts(term: Term, columns: Columns) -> Columns:
    """Returns columns of a term without those of bodies whose mass is not among them.

    The first amplitude of an effect that is whole is its mass: where that does not
    show, or would be negative, what is left of the body is none.
    """
    for number, candidate in enumerate(term.candidates):
        own = term.columns[term.owners == number]
        if candidate.effect.is_whole and own[0] not in columns:
            columns = np.setdiff1d(columns, own)
    return columns


def significant_columns(
    equations: NormalEquations,
    base: Columns,
    terms: Sequence[Term],
    settings: SelectionSettings,
) -> Columns:
    """Returns the columns of effects whose coefficients are not zero by chance.

    Backward elimination: the effect whose Wald test has the highest p-value goes, one
    by one.

    Args:
        equations: by fine blocks, nothing projected out.
        base: columns of the model without effects.
        terms: the effects.
        settings: thresholds.
    """
    owners = owned_columns(terms)
    folds = equations.folds(settings.folds)
    while owners:
        p = p_values(folds, base, owners)
        worst = max(p, key=lambda name: p[name])
        if p[worst] < settings.alpha:
            break
        del owners[worst]
    return np.sort(np.concatenate([np.array([], np.int64), *owners.values()]))


def owned_columns(terms: Sequence[Term]) -> dict[str, Columns]:
    """Returns the columns of each effect, by its name."""
    owners: dict[str, Columns] = {}
    for term in terms:
        for name in term.names:
            known = owners.get(name, np.array([], np.int64))
            owners[name] = np.unique(np.append(known, term.of_name(name)))
    return owners


def p_values(
    equations: NormalEquations, base: Columns, owners: Mapping[str, Columns]
) -> dict[str, float]:
    """Returns the p-value of each effect's coefficients, all fitted together.

    Args:
        equations: by folds, nothing projected out.
        base: columns of the model without effects, which are fitted, too.
        owners: columns of each effect, by its name.
    """
    columns = np.concatenate([base, *owners.values()])
    small = equations.of_columns(columns)
    numbers = np.arange(len(columns))
    x, C = small.solution(numbers), small.covariance(numbers)
    found, at = {}, len(base)
    for name, own in owners.items():
        part = slice(at, at := at + len(own))
        found[name] = largest_t_p(x[part], C[part, part], small.degrees_of_freedom)
    return found


def largest_t_p(x: Array, C: Array, nu: int) -> float:
    """Returns the p-value that coefficients (k,) with a covariance (k, k) are zero.

    The largest of their t-statistics, with nu degrees of freedom, and Bonferroni's
    correction: a covariance of a few folds has no inverse for many coefficients.
    """
    t = np.abs(x) / np.sqrt(np.maximum(np.diagonal(C), 1e-300))
    return float(min(1.0, len(x) * 2.0 * t_distribution.sf(t.max(), nu)))
