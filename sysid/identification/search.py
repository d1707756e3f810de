"""One method's way to the optimum: globally on few rows, then locally on all.

The optimum of a five-parameter fit, measured, is a valley a ten-thousandth of the box
wide. A global search finds its region, for which some sixty rows suffice, at a tenth of
the time. Gauss-Newton descends from there on more and more rows, and its covariance
gives coordinates in which the valley is round: the method searches there again, on all
rows.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drake_disasm.common.progress import Progress, ProgressUpdate, ignore_progress
from sysid.identification.gauss_newton import gauss_newton
from sysid.identification.journal import Journal
from sysid.identification.linearisation import Linearisation
from sysid.identification.result import MethodResult, SearchStage
from sysid.identification.settings import POLISH_SHARE, SearchSettings
from sysid.objective import Objective
from sysid.optimise.bees import BeesAlgorithm, Stop
from sysid.optimise.coordinates import BatchFunction, Box, Whitened
from sysid.optimise.nlopt_search import nlopt_search
from sysid.optimise.trace import Trace

Array = NDArray[np.float64]

_STARTS = 6  # of descents: the best point found need not lie in the right valley
_HALVING = ((2, 3), (1, 15))  # (how many go on, after how many iterations)
_ITERATIONS = 10  # of a descent on more rows
_LAST_ITERATIONS = 4  # on all of them
_MIN_DISTANCE = 0.25  # of the box, between starts
_GLOBAL_STEP = 0.1  # of the box, SBPLX's first
_WHITENED_STEP = 0.05  # of the box of z, SBPLX's first


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
    """Runs one method; a journal keeps what each stage evaluates."""

    def __init__(
        self,
        method: str,
        objectives: Sequence[Objective],
        settings: SearchSettings | None = None,
        journal: Journal | None = None,
        progress: Progress = ignore_progress,
    ) -> None:
        """Prepares a search.

        Args:
            method: one of METHODS.
            objectives: the objective on few rows, on more, and last on all of them.
            settings: how to search.
            journal: keeps what was evaluated, to resume; None keeps nothing.
            progress: called while it works.
        """
        self._settings = settings or SearchSettings()
        self._method, self._full = method, objectives[-1]
        self._objectives = (
            tuple(objectives) if self._settings.local_evaluations else (self._full,)
        )
        self._journal, self._progress = journal, progress

    def run(self) -> MethodResult:
        """Returns where the method ends."""
        stage = self._global(self._objectives[0])
        if not self._settings.local_evaluations:
            best = stage.trace.best, stage.trace.best_value
            return MethodResult(self._method, (stage,), *best)
        valley = self._descended(_starts(stage.trace))
        local = self._local(valley)
        u, value = valley.u, valley.value
        if local.trace.best_value < value:
            u, value = local.trace.best, local.trace.best_value
        return MethodResult(self._method, (stage, local), u, value)

    def _global(self, objective: Objective) -> SearchStage:
        """Searches the unit box."""
        box = Box.unit(len(self._full.model.parameters))
        label = f"{self._method}, global"
        function = self._function(label, objective)
        budget = self._settings.budget
        trace = self._searched(label, function, box, budget, _GLOBAL_STEP)
        return SearchStage(label, objective.model.measurements.rows, trace)

    def _descended(self, starts: list[Array]) -> _Valley:
        """Descends from several points on few rows, from the lowest end on more."""
        label = f"{self._method}, descent"
        kept = self._journal.stage(label) if self._journal else None
        if kept is not None:
            u, value, factor = kept
            return _Valley(np.array(u), value, np.array(factor))
        valley = self._descend(starts, _Counter(label, self._progress))
        if self._journal:
            kept = [valley.u.tolist(), valley.value, valley.factor.tolist()]
            self._journal.finish(label, kept)
        return valley

    def _descend(self, starts: list[Array], report: Callable[[float], None]) -> _Valley:
        first, *others = self._objectives
        for count, iterations in _HALVING:
            ends = [gauss_newton(first, u, iterations, report) for u in starts]
            ends.sort(key=lambda linearisation: first.value(linearisation.residual))
            starts = [linearisation.u for linearisation in ends[:count]]
        linearisation = ends[0]
        for objective in others:
            last = objective is self._full
            iterations = _LAST_ITERATIONS if last else _ITERATIONS
            linearisation = gauss_newton(objective, linearisation.u, iterations, report)
        value = self._full.value(linearisation.residual)
        return _Valley(linearisation.u, value, _factor(linearisation))

    def _local(self, valley: _Valley) -> SearchStage:
        """Searches on all rows in coordinates whitened by the linearisation."""
        label = f"{self._method}, local"
        box = Box.unit(len(valley.u))
        scale = max(valley.value, 1e-9)
        white = Whitened(valley.u, scale * valley.factor, box)
        function = white.wrap(self._function(label, self._full))
        centre = np.zeros((1, len(valley.u)))
        budget = self._settings.local_evaluations
        found = self._searched(
            label, function, white.box, budget, _WHITENED_STEP, centre
        )
        points = [white.to_x(z) for z in found.points]
        trace = Trace(points, found.values, found.cycle_ends, found.stopped)
        return SearchStage(label, self._full.model.measurements.rows, trace)

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
            label: of this stage.
            function: to minimise.
            box: to search.
            budget: evaluations.
            step: SBPLX's first, over the box.
            start: (1, p) a point that is known to be good.
        """
        polish = int(POLISH_SHARE * budget)

        def report(trace: Trace) -> None:
            """Passes on how far the stage is."""
            done, value = trace.evaluations, trace.best_value
            self._progress(ProgressUpdate(label, done, budget, value=value))

        trace = self._explored(function, box, budget - polish, start, report)
        left = budget - trace.evaluations
        best = trace.best if trace.evaluations else None
        return nlopt_search(
            function, box, "LN_SBPLX", left, best, 0, step, trace, report
        )

    def _explored(
        self,
        function: BatchFunction,
        box: Box,
        budget: int,
        start: Array | None,
        report: Callable[[Trace], None],
    ) -> Trace:
        """Returns what the method itself evaluates."""
        settings = self._settings
        if self._method == "nlopt":
            first = None if start is None else start[0]
            seed = settings.seed
            return nlopt_search(
                function, box, "GN_CRS2_LM", budget, first, seed, callback=report
            )
        bees = BeesAlgorithm(box, settings.bees, settings.seed, settings.propose, start)
        stop = Stop(evaluations=budget)
        return bees.run(function, stop=stop, callback=lambda b: report(b.trace))

    def _function(self, label: str, objective: Objective) -> BatchFunction:
        """Returns the objective over the unit box, through the journal."""
        scaling = objective.scaling

        def function(u: Array) -> Array:
            """Returns the values (b,) of points (b, p) of the unit box."""
            return objective(scaling.from_unit(u))

        return self._journal.remembered(label, function) if self._journal else function


class _Counter:
    """Reports the iterations of a stage."""

    def __init__(self, stage: str, progress: Progress) -> None:
        self._stage, self._progress, self._done = stage, progress, 0

    def __call__(self, value: float) -> None:
        """Reports one more, and its value."""
        self._done += 1
        self._progress(ProgressUpdate(self._stage, self._done, value=value))


def _starts(trace: Trace) -> list[Array]:
    """Returns the best points of a search that are apart from each other."""
    chosen: list[Array] = []
    for i in np.argsort(trace.values, kind="stable"):
        point = trace.points[i]
        if all(np.abs(point - other).max() > _MIN_DISTANCE for other in chosen):
            chosen.append(point)
        if len(chosen) == _STARTS:
            break
    return chosen


def _factor(linearisation: Linearisation) -> Array:
    """Returns L with L L^T the covariance; no standard deviation above 0.1."""
    values, vectors = np.linalg.eigh(linearisation.information)
    width = 1.0 / np.sqrt(np.maximum(values, 1e-300))
    factor: Array = vectors * np.minimum(width, 0.1)
    return factor
