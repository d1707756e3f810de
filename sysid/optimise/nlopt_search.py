"""NLopt's controlled random search, and SBPLX to polish its result."""

from collections.abc import Callable
from dataclasses import dataclass, field

import nlopt  # type: ignore[import-untyped]
import numpy as np
from numpy.typing import NDArray

from sysid.optimise.coordinates import BatchFunction, Box
from sysid.optimise.trace import Trace

Array = NDArray[np.float64]


def nlopt_search(
    function: BatchFunction,
    box: Box,
    algorithm: str,
    evaluations: int,
    start: Array | None = None,
    seed: int = 0,
    step: float | Array = 0.1,
    trace: Trace | None = None,
    callback: Callable[[Trace], None] | None = None,
) -> Trace:
    """Minimises within a box by one of NLopt's derivative-free algorithms.

    A failure inside NLopt (round-off, a point a rounding error outside) ends the
    search but loses nothing: the best point is taken from the trace, never from the
    solver. The budget is the only stopping criterion, since on a noisy function
    tolerances are met anywhere.

    Args:
        function: values of a batch; it is asked for one point at a time.
        box: to search.
        algorithm: NLopt's name, such as "GN_CRS2_LM" or "LN_SBPLX".
        evaluations: maximum.
        start: (p,) where to begin; the middle of the box by default.
        seed: of NLopt's generator, which all its searches in a process share.
        step: first step of a local search over the box's width, one or (p,).
        trace: to go on with.
        callback: called after every evaluation.
    """
    trace = trace if trace is not None else Trace()
    solver = _solver(algorithm, box, evaluations, step * box.width)
    limit = trace.evaluations + evaluations
    evaluator = _Evaluator(function, box, solver, trace, limit, callback)
    solver.set_min_objective(evaluator)
    nlopt.srand(seed)
    begin = (box.low + box.high) / 2 if start is None else start
    trace.stopped = _outcome(solver, box.clip(begin))
    if evaluator.errors:
        raise evaluator.errors[0]
    trace.cycle_ends.append(trace.evaluations)
    return trace


@dataclass
class _Evaluator:
    """Evaluates points for NLopt, one at a time.

    Attributes:
        function, box, solver: of the search.
        trace: gets each evaluation.
        limit: of its evaluations; some algorithms overrun their own.
        callback: called after each.
        errors: what was raised, Ctrl-C too: it must not get lost in C++.
    """

    function: BatchFunction
    box: Box
    solver: nlopt.opt
    trace: Trace
    limit: int
    callback: Callable[[Trace], None] | None
    errors: list[BaseException] = field(default_factory=list)

    def __call__(self, x: Array, gradient: Array) -> float:
        """Returns the value at x (p,), or stops the solver."""
        if self.errors or self.trace.evaluations >= self.limit:
            return self._stop()
        try:
            point = self.box.clip(x)[None]
            self.trace.add(point, self.function(point))
            if self.callback:
                self.callback(self.trace)
        except BaseException as error:
            self.errors.append(error)
            return self._stop()
        return self.trace.values[-1]

    def _stop(self) -> float:
        self.solver.force_stop()
        return np.inf


def _solver(algorithm: str, box: Box, evaluations: int, step: Array) -> nlopt.opt:
    solver = nlopt.opt(getattr(nlopt, algorithm), box.size)
    solver.set_lower_bounds(box.low)
    solver.set_upper_bounds(box.high)
    solver.set_maxeval(evaluations)
    solver.set_initial_step(step)
    return solver


def _outcome(solver: nlopt.opt, start: Array) -> str:
    """Runs the solver; returns why it ended."""
    try:
        solver.optimize(start)
    except (nlopt.RoundoffLimited, nlopt.ForcedStop, RuntimeError) as error:
        if isinstance(error, nlopt.ForcedStop):
            return "budget"
        return f"NLopt: {error}"
    if solver.last_optimize_result() == nlopt.MAXEVAL_REACHED:
        return "budget"
    return "converged"
