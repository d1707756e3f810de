"""NLopt's controlled random search, and SBPLX to polish its result."""

from collections.abc import Callable

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
    last = trace.evaluations + evaluations

    errors: list[BaseException] = []

    def value(x: Array, gradient: Array) -> float:
        """Evaluates one point for NLopt."""
        if errors or trace.evaluations >= last:  # some overrun their own limit
            solver.force_stop()
            return np.inf
        try:
            point = box.clip(x)[None]
            trace.add(point, function(point))
            if callback:
                callback(trace)
        except BaseException as error:  # Ctrl-C too: it must not get lost in C++
            errors.append(error)
            solver.force_stop()
            return np.inf
        return trace.values[-1]

    solver = _solver(algorithm, box, evaluations, step * box.width)
    solver.set_min_objective(value)
    nlopt.srand(seed)
    begin = (box.low + box.high) / 2 if start is None else start
    trace.stopped = _outcome(solver, box.clip(begin))
    if errors:
        raise errors[0]
    trace.cycle_ends.append(trace.evaluations)
    return trace


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
