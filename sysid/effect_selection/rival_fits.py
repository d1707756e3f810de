"""Rivals that a few rows can't tell from an effect, fitted to all rows."""

import dataclasses
import time
from collections.abc import Sequence

from sysid.effect_selection.forward_selection import Gain, Step
from sysid.fitting.candidates import Candidate
from sysid.fitting.fit import Fit
from sysid.fitting.fitter import Fitter


def judged_by_all_rows(
    fitter: Fitter, last: Fit, steps: Sequence[Step], deadline: float
) -> list[Step]:
    """Returns steps with those rivals alone that fits to all rows leave ambiguous.

    A rival takes the place of the effects of its step, all its amplitudes free; the
    others of the model stay.

    Args:
        fitter: of all rows.
        last: the model with all effects, fitted to them.
        steps: of a search on few rows.
        deadline: by `time.monotonic` [s], after which rivals stay as they are.
    """
    found = []
    for step in steps:
        names = set(step.chosen.term.names)
        others = tuple(e for e in last.effects if e.name not in names)
        if not step.rivals or len(others) == len(last.effects):
            found.append(step)
            continue
        without = fitter.fit(others, last)
        chosen = _gain(step.chosen, without, last)
        kept = []
        for rival in step.rivals:
            if time.monotonic() < deadline:
                rest = {e.name for e in others}
                own = [c for c in rival.term.candidates if c.name not in rest]
                if not own:  # the model has it already, and that was not enough
                    continue
                more = tuple(Candidate.of(c.effect) for c in own)
                gain = _gain(rival, without, fitter.fit((*others, *more), without))
                if not gain.is_ambiguous_with(chosen, fitter.settings):
                    continue
            kept.append(rival)
        found.append(dataclasses.replace(step, rivals=tuple(kept)))
    return found


def _gain(of: Gain, before: Fit, after: Fit) -> Gain:
    """Returns a term's gain by fits with and without it."""
    losses = before.held_out_losses, after.held_out_losses
    of_folds = (losses[0] - losses[1]) / max(float(losses[0].sum()), 1e-300)
    return Gain(of.term, float(of_folds.sum()), of_folds)
