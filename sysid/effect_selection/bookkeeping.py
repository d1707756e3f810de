"""Whether a log was written otherwise than it says: a sign, an order, a frame.

Such hypotheses compete with effects. One is taken that explains more by itself than the
best effect does, or lowers the held-out error with all effects in; the selection then
starts anew from the log as it should have been written.
"""

from collections.abc import Callable, Sequence

from sysid.effect_selection.search import SearchResult
from sysid.fitting.fit import Fit
from sysid.fitting.fitter import Fitter
from sysid.identification.noise import with_noise_of
from sysid.models.base import LogModel
from sysid.models.bookkeeping import Bookkeeping
from sysid.models.channel_grams import is_replicated


def best_hypothesis(
    fitter: Fitter,
    found: SearchResult,
    hypotheses: Sequence[Bookkeeping[LogModel]],
    rows: Callable[[LogModel], LogModel],
) -> Bookkeeping[LogModel] | None:
    """Returns the hypothesis that explains a log better than effects do; None if none.

    Args:
        fitter: of the log as it was written.
        found: effects that it seems to need.
        hypotheses: on how it was written.
        rows: returns a model of the rows that are fitted.
    """
    least = fitter.settings.min_gain
    best_effect = max((gain.share for gain in found.begin), default=0.0)
    gains = {}
    for number, each in enumerate(hypotheses):
        own = fitter.with_base(with_noise_of(fitter.base, rows(each.model)))
        alone = own.fit(())
        gain = _gain(found.first, alone)
        if gain < max(least, best_effect):
            gain = _gain(found.last, own.fit(found.last.effects, alone))
        if gain >= least:
            gains[number] = gain
    if not gains:
        return None
    return hypotheses[max(gains, key=lambda number: gains[number])]


def _gain(before: Fit, after: Fit) -> float:
    """Returns the share of the held-out loss that one fit takes away of another's.

    Zero, if more than one part of the log asks for the other: a log is written in one
    way from end to end.
    """
    left, lost = (fit.held_out_losses.sum(axis=1) for fit in (after, before))
    if not is_replicated(left, lost):
        return 0.0
    return float(1.0 - left.sum() / max(lost.sum(), 1e-300))
