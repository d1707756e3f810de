"""One method's way to the optimum: globally on few rows, then closely on all.

The measured optimum of a five-parameter fit is a valley a ten-thousandth of the box
wide. A global search finds the region of it, and needs no more than some sixty rows
for that, at a tenth of the time. A descent follows, on more and more rows, and gives
coordinates in which the valley is round, where the method searches again, on all rows.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sysid.identification.gauss_newton import gauss_newton
from sysid.identification.journal import Journal
from sysid.identification.linearisation import Linearisation
from sysid.identification.result import MethodResult, SearchPart
from sysid.objective import Objective
from sysid.optimise.bees import BeesAlgorithm, BeesSettings, Propose, Stop
from sysid.optimise.coordinates import BatchFunction, Box, Whitened
from sysid.optimise.nlopt_search import nlopt_search
from sysid.optimise.trace import Trace

Array = NDArray[np.float64]

METHODS = ("bees", "nlopt")

_POLISH = 0.25  # part of a search that SBPLX gets at its end
_STARTS = 6  # of descents: the lowest point found need not lie in the right valley
_HALVING = ((2, 3), (1, 15))  # so many of them go on after so many iterations
_ITERATIONS = 10  # of a descent on more rows
_LAST_ITERATIONS = 4  # on all of them
_APART = 0.25  # of the box, between them
_WHITENED_STEP = 0.05  # SBPLX's first step over the box of z


@dataclass(frozen=True)
class Effort:
    """How hard a method tries.

    Attributes:
        evaluations: of the global search, polish included.
        cycles: of the bees, instead; NLopt then gets as many evaluations.
        close: evaluations of the close search on all rows; 0 leaves it and
            Gauss-Newton out, and searches globally on all rows (the thesis's way).
        bees: the colony.
        seed: of the searches.
        propose: a surrogate's proposals in place of scouts, for the bees.
    """

    evaluations: int = 400
    cycles: int | None = None
    close: int = 40
    bees: BeesSettings = field(default_factory=BeesSettings)
    seed: int = 0
    propose: Propose | None = None

    @property
    def budget(self) -> int:
        """Evaluations of the global search, whatever limits it."""
        if self.cycles is None:
            return self.evaluations
        bees = self.bees.initial + (self.cycles) * self.bees.per_cycle
        return int(np.ceil(bees / (1.0 - _POLISH)))


#: Called after each batch: part, evaluations done, evaluations in all, best value.
News = Callable[[str, int, int, float], None]


@dataclass(frozen=True)
class _Valley:
    """Where a descent ended.

    Attributes:
        u: (p,) in the unit box.
        value: of the objective on all rows.
        factor: (p, p) L with L L^T the covariance for a noise of one.
    """

    u: Array
    value: float
    factor: Array


class Search:
    """Runs one method; each part's evaluations go through the journal."""

    def __init__(
        self,
        method: str,
        ladder: Sequence[Objective],
        effort: Effort,
        journal: Journal,
        news: News,
    ) -> None:
        """Prepares a search.

        Args:
            method: one of METHODS.
            ladder: the objective on few rows, on more, and last on all of them.
            effort: how hard to try.
            journal: keeps what was evaluated.
            news: called while it works.
        """
        self._method, self._full, self._effort = method, ladder[-1], effort
        self._ladder = tuple(ladder) if effort.close else (ladder[-1],)
        self._journal, self._news = journal, news

    def run(self) -> MethodResult:
        """Returns where the method ends."""
        part = self._part("global", self._ladder[0])
        if not self._effort.close:
            best = part.trace.best, part.trace.best_value
            return MethodResult(self._method, (part,), *best)
        valley = self._descended(_starts(part.trace))
        close = self._close(valley)
        u, value = valley.u, valley.value
        if close.trace.best_value < value:
            u, value = close.trace.best, close.trace.best_value
        return MethodResult(self._method, (part, close), u, value)

    def _part(self, name: str, objective: Objective) -> SearchPart:
        """Searches the unit box."""
        box = Box.unit(len(self._full.model.parameters))
        label = f"{self._method}, {name}"
        function = self._function(label, objective)
        trace = self._searched(label, function, box, self._effort.budget, 0.1)
        return SearchPart(label, objective.model.measurements.rows, trace)

    def _descended(self, starts: list[Array]) -> _Valley:
        """Goes down from several points on few rows, from the lowest end on more."""
        name = f"{self._method}, descent"
        kept = self._journal.stage(name)
        if kept is not None:
            u, value, factor = kept
            return _Valley(np.array(u), value, np.array(factor))

        def tell(value: float) -> None:
            """Passes the news on."""
            self._news(name, 0, 0, value)

        first, *others = self._ladder
        for count, iterations in _HALVING:
            valleys = [gauss_newton(first, u, iterations, tell) for u in starts]
            valleys.sort(key=lambda linearisation: first.value(linearisation.residual))
            starts = [linearisation.u for linearisation in valleys[:count]]
        linearisation = valleys[0]
        for objective in others:
            last = objective is self._full
            iterations = _LAST_ITERATIONS if last else _ITERATIONS
            linearisation = gauss_newton(objective, linearisation.u, iterations, tell)
        valley = _Valley(
            linearisation.u,
            self._full.value(linearisation.residual),
            _factor(linearisation),
        )
        self._journal.finish(
            name, [valley.u.tolist(), valley.value, valley.factor.tolist()]
        )
        return valley

    def _close(self, valley: _Valley) -> SearchPart:
        """Searches on all rows in coordinates whitened by the linearisation."""
        label = f"{self._method}, close"
        box = Box.unit(len(valley.u))
        scale = max(valley.value, 1e-9)
        white = Whitened(valley.u, scale * valley.factor, box)
        function = white.wrap(self._function(label, self._full))
        centre = np.zeros((1, len(valley.u)))
        found = self._searched(
            label, function, white.box, self._effort.close, _WHITENED_STEP, centre
        )
        points = [white.to_x(z) for z in found.points]
        trace = Trace(points, found.values, found.cycle_ends, found.stopped)
        return SearchPart(label, self._full.model.measurements.rows, trace)

    def _searched(
        self,
        label: str,
        function: BatchFunction,
        box: Box,
        budget: int,
        step: float,
        start: Array | None = None,
    ) -> Trace:
        """Spends a budget: the method, then SBPLX from its best.

        Args:
            label: of this part.
            function: to minimise.
            box: to search.
            budget: evaluations.
            step: SBPLX's first, over the box.
            start: (1, p) a point that is known to be good.
        """
        polish = int(_POLISH * budget)

        def tell(trace: Trace) -> None:
            """Passes the news on."""
            self._news(label, trace.evaluations, budget, trace.best_value)

        trace = self._explored(function, box, budget - polish, start, tell)
        left = budget - trace.evaluations
        best = trace.best if trace.evaluations else None
        return nlopt_search(function, box, "LN_SBPLX", left, best, 0, step, trace, tell)

    def _explored(
        self,
        function: BatchFunction,
        box: Box,
        budget: int,
        start: Array | None,
        tell: Callable[[Trace], None],
    ) -> Trace:
        effort = self._effort
        if self._method == "nlopt":
            first = None if start is None else start[0]
            return nlopt_search(
                function, box, "GN_CRS2_LM", budget, first, effort.seed, callback=tell
            )
        bees = BeesAlgorithm(box, effort.bees, effort.seed, effort.propose, start)
        stop = Stop(evaluations=budget)
        return bees.run(function, stop=stop, callback=lambda b: tell(b.trace))

    def _function(self, label: str, objective: Objective) -> BatchFunction:
        scaling = objective.scaling
        return self._journal.remembered(
            label, lambda u: objective(scaling.from_unit(u))
        )


def _starts(trace: Trace) -> list[Array]:
    """Returns the best points of a search that are apart from each other."""
    chosen: list[Array] = []
    for i in np.argsort(trace.values, kind="stable"):
        point = trace.points[i]
        if all(np.abs(point - other).max() > _APART for other in chosen):
            chosen.append(point)
        if len(chosen) == _STARTS:
            break
    return chosen


def _factor(linearisation: Linearisation) -> Array:
    """Returns L with L L^T the covariance, no direction wider than half the box."""
    values, vectors = np.linalg.eigh(linearisation.information)
    width = 1.0 / np.sqrt(np.maximum(values, 1e-300))
    factor: Array = vectors * np.minimum(width, 0.1)
    return factor
