"""Gauss-Newton within the box, damped as by Levenberg and Marquardt."""

import math
import time
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from sysid.identification.linearisation import (
    Linearisation,
    fitting_steps,
    linearise,
    linearise_again,
)
from sysid.objective import Objective

Array = NDArray[np.float64]

_DAMPING = (0.0, 1e-3, 1e-2, 1e-1, 1.0, 10.0)  # all tried at once, as one batch
#: Share of the objective that an iteration has to gain for another one to follow.
MIN_GAIN = 1e-3
#: Steps that gain little far from the noise are tried so many times as long.
_LONGER = (8.0, 64.0)
_LITTLE = 0.02  # of the objective
_FAR = 1.2  # times the noise


def gauss_newton(
    objective: Objective,
    u: Array,
    iterations: int = 6,
    callback: Callable[[float], None] | None = None,
    start: Linearisation | None = None,
    central: bool = True,
    min_gain: float = MIN_GAIN,
    deadline: float = math.inf,
) -> Linearisation:
    """Returns the linearisation at the point to which Gauss-Newton steps lead from u.

    Each step is SciPy's bounded linear least squares, weighted by Huber's weights
    and damped as by Levenberg and Marquardt; of six dampings, evaluated at once, the
    best is taken. It finds the local optimum, and how sharp that is. With one-sided
    differences each parameter is tried alone where no step of all of them helps, and
    longer steps where usual ones gain little.

    Args:
        objective: to minimise.
        u: (p,) where to begin, in the unit box.
        iterations: at most.
        callback: called with the value before each.
        start: the linearisation at u, if it is known.
        central: whether differences are central, or one-sided at half the price; then
            damping is tried only where the full step does not help.
        min_gain: share of the objective that an iteration has to gain for another one
            to follow.
        deadline: by `time.monotonic` [s], after which no iteration is begun.
    """
    linearisation = linearise(objective, u, central=central) if start is None else start
    for _ in range(iterations if len(u) else 0):
        if time.monotonic() > deadline:
            break
        value = objective.value(linearisation.residual)
        if callback:
            callback(value)
        point, residual = _next(objective, linearisation, min_gain, central)
        reached = objective.value(residual)
        if reached >= value:
            break
        steps = fitting_steps(linearisation)
        if central:
            linearisation = linearise(objective, point, steps)
        else:
            linearisation = linearise_again(
                linearisation, objective, point, steps, residual
            )
        if reached > (1.0 - min_gain) * value:
            break
    return linearisation


def _next(
    objective: Objective, linearisation: Linearisation, min_gain: float, central: bool
) -> tuple[Array, Array]:
    """Returns the best point (p,) that steps lead to, and the residuals there.

    Longer steps are tried too where usual ones gain little far from the noise and the
    loss is Huber's, whose weights give rows that are steep and far off a curvature that
    the loss has not; but not where an evaluation takes seconds.
    """
    value = objective.value(linearisation.residual)
    steps = _steps(linearisation)
    batches = _batches(objective, linearisation, steps, min_gain, central)
    best = _best(objective, batches, value)
    reached = objective.value(best[1])
    is_done = value <= _FAR or reached < (1.0 - _LITTLE) * value
    if central or is_done or objective.model.costly or np.isinf(objective.huber_delta):
        return best
    longer = _best(objective, [_longer(linearisation, steps[:1])], reached)
    return longer if objective.value(longer[1]) < reached else best


def _batches(
    objective: Objective,
    linearisation: Linearisation,
    steps: Array,
    min_gain: float,
    all_at_once: bool,
) -> list[Array]:
    """Returns the points (d, p) that are evaluated together, one batch after the other
    as long as none is better.

    Damped steps promise less than the full one: where that promises less than is worth
    another iteration, they are not tried; nor is each parameter alone.
    """
    u = linearisation.u
    points = np.clip(u + steps, 0.0, 1.0)
    if all_at_once:
        return [points]
    promised = objective.value(
        linearisation.residual + linearisation.jacobian @ (points[0] - u)
    )
    if promised > (1.0 - min_gain) * objective.value(linearisation.residual):
        return [points[:1]]
    alone = [np.clip(u + _alone(linearisation), 0.0, 1.0)] if len(u) > 1 else []
    return [points[:1], points[1:], *alone]


def _best(
    objective: Objective, batches: Sequence[Array], value: float
) -> tuple[Array, Array]:
    """Returns the best of the first batch of points (d, p) that betters a value.

    And the residuals there.
    """
    for batch in batches:
        residuals = objective.residuals(objective.scaling.from_unit(batch))
        values = [objective.value(r) for r in residuals]
        best = int(np.argmin(values))
        if values[best] < value:
            break
    return batch[best], residuals[best]


def _alone(linearisation: Linearisation) -> Array:
    """Returns steps (p, p) along one parameter each.

    A parameter whose derivative is that of a wall, since its difference makes a contact
    that is not there, spoils every step that all take together.
    """
    J, r = linearisation.flat_jacobian, linearisation.residual.reshape(-1)
    w = linearisation.weights.reshape(-1)
    slope, power = J.T @ (w * r), np.einsum("ip,i,ip->p", J, w, J)
    return np.asarray(np.diag(-slope / np.maximum(power, 1e-300)))


def _longer(linearisation: Linearisation, steps: Array) -> Array:
    """Returns points (d, p) beyond the full step (1, p), and beyond those of one
    parameter.

    Where a few rows are steep and far off, as at a wall, the weights that stand for
    Huber's loss give it a curvature that it has not: steps lead downhill, but are a
    hundred times too short.
    """
    if len(linearisation.u) > 1:
        steps = np.concatenate([steps, _alone(linearisation)])
    longer = np.concatenate([times * steps for times in _LONGER])
    return np.asarray(np.clip(linearisation.u + longer, 0.0, 1.0))


def _steps(linearisation: Linearisation) -> Array:
    """Returns weighted least-squares steps (d, p) that stay in the box, one for each
    damping.
    """
    root = np.sqrt(linearisation.weights).reshape(-1)
    system = np.column_stack(
        [linearisation.flat_jacobian, linearisation.residual.reshape(-1)]
    )
    factor = np.asarray(np.linalg.qr(root[:, None] * system, mode="r"))
    R, Qr = factor[:, :-1], factor[:, -1]
    size = np.linalg.norm(R, axis=0)
    least = 1e-9 * max(1.0, float(size.max()))
    b = np.concatenate([-Qr, np.zeros(len(linearisation.u))])
    bounds = (-linearisation.u - 1e-12, 1.0 - linearisation.u + 1e-12)
    ridges = [np.sqrt(damping) * size + least for damping in _DAMPING]
    return np.array(
        [lsq_linear(np.vstack([R, np.diag(r)]), b, bounds).x for r in ridges]
    )
