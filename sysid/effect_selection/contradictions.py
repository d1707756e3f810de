"""Finds episodes that contradict each other: no common effect explains both."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from sysid.effect_selection.block_regression import BlockRegression, Columns
from sysid.effect_selection.fit import Fit
from sysid.effect_selection.significance import Scores, family_p
from sysid.effect_selection.survey import LinearSurvey

_OWN = "the model's own parameters"


@dataclass(frozen=True)
class Contradiction:
    """Episodes that an effect explains only with different amplitudes in each.

    Attributes:
        episodes: names; one that differs from all others, or the only two.
        effect: that differs; the simplest of those that explain most.
        gain: share of the loss that this takes away, judged on blocks that were not
            fitted.
    """

    episodes: tuple[str, ...]
    effect: str
    gain: float


def contradictions(
    fit: Fit, survey: LinearSurvey, own: int
) -> tuple[Contradiction, ...]:
    """Returns the episodes that contradict the others, the worst first.

    A candidate whose amplitudes may differ in one episode is compared with the same
    with common amplitudes, on blocks that were not fitted.

    Args:
        fit: with all effects that all episodes have in common.
        survey: at that fit.
        own: number of the parameters that the model has anyway.
    """
    names = fit.model.measurements.names
    most = fit.settings.contradiction_max_episodes
    if not 1 < len(names) <= most or _is_noise(fit):
        return ()
    numbers = range(len(names)) if len(names) > 2 else [1]
    found, raw = [], survey.raw()
    for number in numbers:
        best = _difference(fit, survey, raw, own, number, len(numbers))
        if best:
            which = (names[number],) if len(names) > 2 else names
            found.append(Contradiction(which, *best))
    return tuple(sorted(found, key=lambda each: -each.gain))


def _is_noise(fit: Fit) -> bool:
    """Returns whether channels whose noise is known leave nothing to explain."""
    return fit.noise_is_stated and fit.objective < fit.settings.noise_level


def _difference(
    fit: Fit,
    survey: LinearSurvey,
    raw: BlockRegression,
    own: int,
    number: int,
    tests: int,
) -> tuple[str, float] | None:
    """Returns what differs in an episode and how much that explains; else None.

    Most blocks have to gain, or the noise is stated and can't be so large, and all
    other episodes are at the noise: what an episode alone has gains nothing in those,
    if its rows weigh little in a fit. (Rows that are missed by far in every episode are
    no contradiction.)
    """
    limits, size, begin = fit.settings, len(survey.fields), len(raw.scale)
    both = raw.with_own_parameters(survey.episodes == number, size)
    regression = both.project_out(np.arange(len(fit.theta)))
    sets = [(text, columns) for text, columns in survey.groups.items() if len(columns)]
    sets += [(e.text, fit.columns_of(e)) for e in fit.effects]
    sets.append((_OWN, np.arange(own)))
    gains = np.column_stack([_gains(regression, columns, begin) for _, columns in sets])
    unit = gains / max(np.linalg.norm(gains, axis=0).max(), 1e-300)
    scores = [Scores(g.sum(keepdims=True), g[:, None]) for g in unit.T]
    p = family_p(scores, limits) * tests
    share = np.mean(gains > 0.0, axis=0)
    gain = gains.sum(axis=0) / regression.block_losses.sum()
    passed = (p < limits.alpha) & (share >= limits.contradiction_min_block_share)
    if fit.noise_is_stated and _are_at_noise(fit, regression, survey, number):
        counts = np.array([len(columns) for _, columns in sets])
        by_noise = chi2.sf(np.maximum(gains.sum(axis=0), 0.0), counts)
        passed |= by_noise * len(sets) * tests < limits.alpha
    passed &= gain >= limits.contradiction_min_gain
    if not passed.any():
        return None
    enough = (1.0 - limits.contradiction_parsimony_tolerance) * gain[passed].max()
    good = np.flatnonzero(passed & (gain >= enough))
    best = min(good, key=lambda i: len(sets[i][1]))
    return sets[best][0], float(gain[best])


def _are_at_noise(
    fit: Fit, regression: BlockRegression, survey: LinearSurvey, number: int
) -> bool:
    """Returns whether the episodes but one leave no more than the noise."""
    others = survey.episodes != number
    sizes = np.diff(regression.begins, append=len(regression.r))
    left = regression.block_losses[others].sum() / sizes[others].sum()
    return bool(np.sqrt(left) <= fit.settings.max_objective_at_noise)


def _gains(
    regression: BlockRegression, columns: Columns, begin: int
) -> NDArray[np.float64]:
    """Returns what blocks gain, (B,), if columns may differ in the episode.

    Than with the same in all, or without them where that leaves less.
    """
    common = regression.held_out_losses(columns)
    if common.sum() > regression.block_losses.sum():
        common = regression.block_losses
    both = np.concatenate([columns, begin + columns])
    return common - regression.held_out_losses(both)
