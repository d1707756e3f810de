"""Compares fits of what was tried: the best, what is as good, and what ties with it."""

import dataclasses
import itertools
from collections.abc import Sequence

import numpy as np

from sysid.effect_selection.evidence import Evidence
from sysid.effect_selection.fit import Fit
from sysid.effect_selection.settings import SelectionSettings

#: What was tried, and its fit.
Trial = tuple[Evidence, Fit]


def ties_by_fit(
    best: Evidence,
    rivals: Sequence[Evidence],
    confirmed: Sequence[Trial],
    before: Fit,
    found: Fit,
) -> tuple[Evidence, ...]:
    """Returns rivals that could explain as much as the chosen effect's fit does.

    Those that were fitted are judged by their fits, but for the row at which the two
    differ most: where a bolt jams, micrometres decide. Others are judged by the linear
    account: how much less they explain by it than the best does by the same.
    """
    limit = (1.0 + found.settings.refit_tie_margin) * found.loss
    others = sorted(confirmed, key=lambda trial: -trial[1].loss)
    others = [trial for trial in others if trial[0].effects != best.effects]
    losses = {e.effects: loss_but_for_a_row(fit, found) for e, fit in others}
    known = {e.effects: e for e, _ in others}
    for rival in rivals:
        less = (best.gain - rival.gain) * before.loss
        losses.setdefault(rival.effects, found.loss + less)
        known.setdefault(rival.effects, rival)
    return tuple(rival for name, rival in known.items() if losses[name] <= limit)


def loss_but_for_a_row(fit: Fit, other: Fit) -> float:
    """Returns a fit's loss, with another's at the row at which they differ most."""
    losses = [np.sum(each.bounded_residual**2, axis=1) for each in (fit, other)]
    more = losses[0] - losses[1]
    return fit.loss - float(more[np.argmax(np.abs(more))])


def pairs_of(tried: Sequence[Trial], settings: SelectionSettings) -> list[Evidence]:
    """Returns pairs of what was tried alone, the best first."""
    order = sorted(tried, key=lambda trial: trial[1].loss)
    return [
        dataclasses.replace(
            first,
            explanation=(*first.candidates, *second.candidates),
            parameter_count=first.parameter_count + second.parameter_count,
        )
        for (first, _), (second, _) in itertools.combinations(order, 2)
    ][: settings.refit_max_pairs]


def as_good_as_the_best(confirmed: Sequence[Trial], before: Fit) -> Trial:
    """Returns the simplest of the fits that leave about as little as the best does.

    That is the first in their rankings. Where the model is off by itself a little less
    is no reason: a step of the sensor that begins at once is no better than an offset.
    Nor is a single row; the simplest is that with the fewest parameters then.
    """
    settings = before.settings
    best = min((fit for _, fit in confirmed), key=lambda fit: fit.loss)
    if not before.states_model_error:
        limit = (1.0 + settings.min_gain) * best.loss
        return next(trial for trial in confirmed if trial[1].loss <= limit)
    rivals = [fit for _, fit in confirmed if loss_but_for_a_row(fit, best) < best.loss]
    best = min(rivals, key=lambda fit: loss_but_for_a_row(fit, best), default=best)
    limit = (1.0 + settings.parsimony_tolerance) * best.loss
    as_good = [t for t in confirmed if loss_but_for_a_row(t[1], best) <= limit]
    return min(as_good, key=lambda trial: len(trial[1].theta))
