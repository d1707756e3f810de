"""A Gaussian process that proposes points between the bees' cycles.

The thesis names surrogates as future work: where an evaluation is expensive, a model
of the objective from the points so far says where the next one is worth it. This is
expected improvement (Jones et al. 1998) on scikit-learn's Gaussian process.
"""

import warnings

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm
from sklearn.exceptions import ConvergenceWarning  # type: ignore[import-untyped]
from sklearn.gaussian_process import (  # type: ignore[import-untyped]
    GaussianProcessRegressor,
)
from sklearn.gaussian_process.kernels import (  # type: ignore[import-untyped]
    ConstantKernel,
    Matern,
    WhiteKernel,
)

from sysid.optimise.coordinates import Box
from sysid.optimise.trace import Trace

Array = NDArray[np.float64]

_LEARNT_FROM = 200  # best points: the cost grows with the cube
_CANDIDATES = 2000
_LOCAL = (0.1, 0.03, 0.01)  # spreads about the best point, over the box


def propose(
    trace: Trace, box: Box, count: int, generator: np.random.Generator
) -> Array:
    """Returns points (count, p) of the largest expected improvement.

    The process is fitted to the objective's logarithm: it spans decades, and what
    matters is its lower end. After each chosen point its own prediction there is added
    to the data, so that the next one is chosen elsewhere.

    Args:
        trace: evaluations so far.
        box: to choose from.
        count: how many points.
        generator: of the candidates.
    """
    x, y = _known(trace, box)
    process = _process(box.size)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        process.fit(x, y)
    candidates = _candidates(x[int(np.argmin(y))], generator)
    process.optimizer = None
    chosen = []
    for _ in range(count):
        number = int(np.argmax(_improvement(process, candidates, y.min())))
        best = candidates[number]
        candidates = np.delete(candidates, number, axis=0)
        chosen.append(best)
        x, y = np.vstack([x, best]), np.append(y, process.predict(best[None]))
        process.kernel = process.kernel_
        process.fit(x, y)
    return box.low + np.array(chosen) * box.width


def _known(trace: Trace, box: Box) -> tuple[Array, Array]:
    """Returns points in the unit box and standardised logarithms of their values."""
    values = np.array(trace.values)
    order = np.argsort(values, kind="stable")[:_LEARNT_FROM]
    x = (np.array(trace.points)[order] - box.low) / box.width
    y = np.log(np.maximum(values[order], 1e-300) - min(0.0, values.min()))
    return x, (y - y.mean()) / max(float(y.std()), 1e-12)


def _process(size: int) -> GaussianProcessRegressor:
    lengths = Matern(np.full(size, 0.3), (0.01, 10.0), nu=2.5)
    kernel = ConstantKernel(1.0, (0.1, 10.0)) * lengths + WhiteKernel(1e-3, (1e-6, 0.1))
    return GaussianProcessRegressor(kernel, random_state=0)


def _candidates(best: Array, generator: np.random.Generator) -> Array:
    size = len(best)
    everywhere = generator.uniform(0.0, 1.0, (_CANDIDATES, size))
    near = [
        best + spread * generator.normal(size=(_CANDIDATES // 4, size))
        for spread in _LOCAL
    ]
    return np.clip(np.vstack([everywhere, *near]), 0.0, 1.0)


def _improvement(process: GaussianProcessRegressor, x: Array, best: float) -> Array:
    """Returns the expected improvement (n,) over the best value at points (n, p)."""
    mean, deviation = process.predict(x, return_std=True)
    deviation = np.maximum(deviation, 1e-12)
    z = (best - mean) / deviation
    gain: Array = deviation * (z * norm.cdf(z) + norm.pdf(z))
    return gain
