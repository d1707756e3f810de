"""Rivals that a few rows can't tell from an effect, fitted to all rows."""

import time
from collections.abc import Sequence

from sysid.effect_selection.forward_selection import Gain, Step
from sysid.effect_selection.refit_selection import simplified
from sysid.fitting.candidates import Candidate
from sysid.fitting.fit import Fit
from sysid.fitting.fitter import Fitter


def judged_by_all_rows(
    fitter: Fitter,
    library: Sequence[Candidate],
    last: Fit,
    steps: Sequence[Step],
    deadline: float,
) -> tuple[Fit, list[Step]]:
    """Returns the model and its steps, as all rows speak for them.

    A rival takes the place of the effects of its step, all its amplitudes free; the
    others of the model stay. Those rivals are kept that leave it ambiguous, and one
    that is better beyond that is chosen instead.

    Args:
        fitter: of all rows.
        library: candidates, in all their shapes.
        last: the model with all effects, fitted to them.
        steps: of a search on few rows.
        deadline: by `time.monotonic` [s], after which rivals stay as they are.
    """
    found = []
    for step in steps:
        names = set(step.chosen.term.names)
        others = tuple(e for e in last.effects if e.name not in names)
        if step.rivals and len(others) < len(last.effects):
            fits = _RivalFits(fitter, library, others, last, deadline)
            last, step = fits.judged(step)
        found.append(step)
    return last, found


class _RivalFits:
    """Fits to all rows in which something takes the place of a step's effects.

    Args:
        others: effects of the model that stay.
        last: the model.
        fitter, library, deadline: see `judged_by_all_rows`.
    """

    def __init__(
        self,
        fitter: Fitter,
        library: Sequence[Candidate],
        others: tuple[Candidate, ...],
        last: Fit,
        deadline: float,
    ) -> None:
        self._fitter, self._few, self._library = fitter, fitter.affordable, library
        self._others, self._last, self._deadline = others, last, deadline
        self._without = fitter.fit(others, last)

    def judged(self, step: Step) -> tuple[Fit, Step]:
        """Returns the model, and the step that it has then."""
        settings, known = self._fitter.settings, {e.name for e in self._others}
        chosen, fits, late = self._gain(step.chosen, self._last), [self._last], []
        gains = [chosen]
        for rival in step.rivals:
            own = [c for c in rival.term.candidates if c.name not in known]
            if time.monotonic() >= self._deadline:
                late.append(rival)
            elif own:  # else the model has it already, and that was not enough
                fits.append(self._fit(own))
                gains.append(self._gain(rival, fits[-1]))
        number = max(range(len(gains)), key=lambda i: gains[i].share)
        if chosen.is_ambiguous_with(gains[number], settings):
            number = 0
        best, fit = gains[number], fits[number]
        rivals = [
            gain
            for gain in gains
            if gain is not best and gain.is_ambiguous_with(best, settings)
        ]
        if best is not chosen:
            fit = simplified(self._fitter, fit, len(self._others))
        return fit, Step(best, (*rivals, *late))

    def _fit(self, own: Sequence[Candidate]) -> Fit:
        """Returns a fit with effects; of one alone in the shape that few rows ask for.

        A fit does not lead from one end of a shape's range to the other where an effect
        on the sensor says where steps begin.
        """
        alone = {c.name for c in own} if len(own) == 1 else ()
        shapes = [c for c in self._library if c.name in alone]
        if len(shapes) < 2:
            more = tuple(Candidate.of(c.effect) for c in own)
            return self._fitter.fit((*self._others, *more), self._without)
        fits = [self._few.fit((*self._others, c), self._without) for c in shapes]
        best = min(fits, key=lambda fit: fit.loss)
        return self._fitter.fit(best.effects, best)

    def _gain(self, of: Gain, after: Fit) -> Gain:
        losses = self._without.held_out_losses, after.held_out_losses
        return Gain.of(of.term, *losses)
