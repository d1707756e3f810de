"""Prescreening far from the data: every effect is fitted to a few rows.

Where the model places the bolt inside the groove's wall, the residual reflects the
stiffness of the wall, and derivatives at null predict nothing of what an effect would
explain.
"""

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sysid.deadline import parts_until
from sysid.fitting.candidates import Candidate, extended
from sysid.fitting.fit import Fit
from sysid.fitting.fitter import Fitter
from sysid.models.base import LogModel
from sysid.objective import Objective
from sysid.workers import Workers

_BETWEEN_LOOKS = 16  # fits that are made before the time is looked at


def prescreening_fits(
    fitter: Fitter,
    fit: Fit,
    sets: Sequence[tuple[Candidate, ...]],
    deadline: float = math.inf,
) -> tuple[Fit, list[Fit]]:
    """Returns a fit to a few rows, and such fits with more effects each.

    Args:
        fitter: of all rows; its workers make the fits.
        fit: to all rows, where they begin.
        sets: effects that are added, each set in a fit of its own; those whose turn
            comes after a deadline have none.
        deadline: by `time.monotonic` [s].
    """
    base = fitter.base.surrogate()
    every = max(1, round(base.measurements.rows / fitter.settings.prescreen_rows))
    small = dataclasses.replace(fitter, base=base.thin(every), workers=Workers())
    before = small.fit(fit.effects, fit)
    jobs = [_PrescreeningFit(small, before, effects) for effects in sets]
    found: list[Fit] = []
    for part in parts_until(deadline, len(jobs), _BETWEEN_LOOKS):
        found += fitter.workers.map(_PrescreeningFit.run, jobs[part])
    return before, found


@dataclass(frozen=True)
class _PrescreeningFit:
    """A fit with effects more than another has, as work for a process."""

    fitter: Fitter
    before: Fit
    added: tuple[Candidate, ...]

    def run(self) -> Fit:
        """Returns the fit; it begins at the amplitude that helps most by itself."""
        effects = (*self.before.effects, *self.added)
        model, _ = extended(self.fitter.base, effects, with_shapes=True)
        return self.fitter.fit(effects, self.before, values=self._best_start(model))

    def _best_start(self, model: LogModel) -> dict[str, float]:
        """Returns the value of the one new amplitude that helps most, if any does.

        Each is tried alone over its range: downhill from null ends where contact does.
        Effects on a sensor's readings are near linear and need no such scan.
        """
        known, scan = self.before.values, self.fitter.settings.prescreen_scan
        theta = [known.get(p.name, p.nominal) for p in model.parameters]
        tries = [
            (i, p.name, float(end * share))
            for i, p in enumerate(model.parameters)
            if p.name not in known and model.simulated[i] and not p.is_shape
            for end in (p.low, p.high)
            if end
            for share in scan
        ]
        if not tries:
            return {}
        thetas = np.tile(theta, (len(tries), 1))
        for row, (i, _, value) in zip(thetas, tries, strict=True):
            row[i] = value
        fitter = self.fitter
        found = Objective(model, fitter.workers, fitter.huber_delta)(thetas)
        best = int(np.argmin(found))
        _, name, value = tries[best]
        return {name: value} if found[best] < self.before.objective else {}
