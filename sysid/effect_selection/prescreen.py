"""Far from the data: every effect is fitted, roughly, to see which is worth more.

A bolt that the model has inside the wall says how hard the wall is, not where; there a
linear account of what effects would do is worthless.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sysid.effect_selection.candidates import extended
from sysid.effect_selection.evidence import What
from sysid.effect_selection.fit import Fit
from sysid.models.base import LogModel
from sysid.objective import Objective
from sysid.workers import Workers

if TYPE_CHECKING:
    from sysid.effect_selection.search import Tracer

_ROWS = 120
_SCANNED = 0.5 / 2.5 ** np.arange(5)  # of the range on either side of null


def rough_fits(
    tracer: Tracer, fit: Fit, whats: Sequence[What]
) -> tuple[Fit, list[Fit]]:
    """Returns a fit to a few rows, and such fits with one effect more each.

    Args:
        tracer: whose base and workers.
        fit: to all rows, where they begin.
        whats: effects that are added, each alone.
    """
    base = tracer.base.surrogate()
    base = base.thin(max(1, round(base.measurements.rows / _ROWS)))
    small = dataclasses.replace(
        tracer, base=base, library=(), workers=Workers(), tell=_silent
    )
    before = small.fit(fit.effects, fit)
    jobs = [_RoughFit(small, before, what) for what in whats]
    return before, tracer.workers.map(_RoughFit.run, jobs)


@dataclass(frozen=True)
class _RoughFit:
    """A fit with effects more than another has, as work for a process."""

    tracer: Tracer
    before: Fit
    what: What

    def run(self) -> Fit:
        """Returns the fit; it begins at the size that helps most by itself."""
        assert isinstance(self.what, tuple)
        effects = (*self.before.effects, *self.what)
        model, _ = extended(self.tracer.base, effects, with_shapes=True)
        return self.tracer.fit(effects, self.before, values=self._scanned(model))

    def _scanned(self, model: LogModel) -> dict[str, float]:
        """Returns the value of the one new size that helps most, if any does.

        Each is tried alone over its range: downhill from null ends where contact does.
        What a sensor does to readings needs no such care.
        """
        known = self.before.values
        theta = [known.get(p.name, p.nominal) for p in model.parameters]
        tries = [
            (i, p.name, float(end * share))
            for i, p in enumerate(model.parameters)
            if p.name not in known and model.simulated[i] and not p.is_shape
            for end in (p.low, p.high)
            if end
            for share in _SCANNED
        ]
        if not tries:
            return {}
        thetas = np.tile(theta, (len(tries), 1))
        for row, (i, _, value) in zip(thetas, tries, strict=True):
            row[i] = value
        found = Objective(model, self.tracer.workers, self.tracer.huber_delta)(thetas)
        best = int(np.argmin(found))
        _, name, value = tries[best]
        return {name: value} if found[best] < self.before.value else {}


def _silent(line: str) -> None:
    """Tells nobody."""
