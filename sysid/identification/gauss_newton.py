"""Downhill from a point: Levenberg and Marquardt within the box."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from sysid.identification.linearisation import (
    Linearisation,
    fitting_steps,
    linearise,
)
from sysid.objective import Objective

Array = NDArray[np.float64]

_DAMPING = (0.0, 1e-3, 1e-2, 1e-1, 1.0, 10.0)  # all tried at once, as one batch
_GAIN = 1e-3  # of the objective, below which another iteration does not pay


def gauss_newton(
    objective: Objective,
    u: Array,
    iterations: int = 6,
    callback: Callable[[float], None] | None = None,
) -> Linearisation:
    """Returns the linearisation where Gauss-Newton steps from u lead to.

    Each step is SciPy's bounded linear least squares, weighted by Huber's weights
    and damped as by Levenberg and Marquardt; of six dampings, evaluated at once, the
    best is taken. Not a search: it finds the bottom of the valley that it starts
    in, and how wide that is.

    Args:
        objective: to minimise.
        u: (p,) where to begin, in the unit box.
        iterations: at most.
        callback: called with the value after each.
    """
    here = linearise(objective, u)
    for _ in range(iterations):
        value = objective.value(here.residual)
        if callback:
            callback(value)
        steps = np.array([_step(here, damping) for damping in _DAMPING])
        points = np.clip(here.u + steps, 0.0, 1.0)
        values = objective(objective.scaling.from_unit(points))
        best = int(np.argmin(values))
        if values[best] >= value:
            break
        here = linearise(objective, points[best], fitting_steps(here))
        if values[best] > (1.0 - _GAIN) * value:
            break
    return here


def _step(here: Linearisation, damping: float) -> Array:
    """Returns the weighted, damped least-squares step (p,) that stays in the box."""
    root = np.sqrt(here.weights).reshape(-1)
    J, r = root[:, None] * here.flat_jacobian, root * here.residual.reshape(-1)
    Q, R = np.linalg.qr(J)
    size = np.linalg.norm(R, axis=0)
    ridge = np.sqrt(damping) * size + 1e-9 * max(1.0, float(size.max()))
    A = np.vstack([R, np.diag(ridge)])
    b = np.concatenate([-Q.T @ r, np.zeros(len(here.u))])
    step: Array = lsq_linear(A, b, (-here.u - 1e-12, 1.0 - here.u + 1e-12)).x
    return step
