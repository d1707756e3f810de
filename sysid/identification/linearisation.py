"""The objective's residuals and their derivatives at a point."""

import dataclasses
import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.deadline import parts_until
from sysid.models.effects import field_of
from sysid.objective import Objective, huber_weights
from sysid.parameters import Parameter

Array = NDArray[np.float64]

FIRST_STEP = 2e-3  # of the parameter's range
_LEAST_STEP = 1e-6
#: For a parameter that hardly matters: over less, the solver's own noise shows.
WIDE_STEP = 0.03
_NOTICEABLE = 3.0  # standard deviations that a step should move the residuals by
_SAME = 1e-6  # of a derivative: rounding of differences
_BETWEEN_LOOKS = 8  # evaluations, or as many as a model takes together


#: Returns what a function finds at points (k, p), or what is kept of it.
Kept = Callable[[Array, Callable[[], list[Array]]], list[Array]]


@dataclass(frozen=True)
class Linearisation:
    """Residuals r(u) near a point u0 of the unit box: r(u) ~ r0 + J (u - u0).

    Attributes:
        u: (p,) the point.
        residual: (rows, channels) in units of the noise.
        jacobian: (rows, channels, p) per range of the parameter.
        weights: (rows, channels) Huber's, 1 for all but outliers.
        huber_delta: residual, in standard deviations, beyond which the loss is linear.
    """

    u: Array
    residual: Array
    jacobian: Array
    weights: Array
    huber_delta: float = np.inf

    @property
    def information(self) -> Array:
        """J^T W J (p, p), the inverse covariance of a noise of one."""
        J, w = self.flat_jacobian, self.weights.reshape(-1)
        return J.T @ (w[:, None] * J)

    @property
    def flat_jacobian(self) -> Array:
        """The jacobian as (rows * channels, p)."""
        rows, channels, size = self.jacobian.shape
        return self.jacobian.reshape(rows * channels, size)

    @property
    def effect(self) -> Array:
        """How much each parameter moves the residuals over its range, rms (p,)."""
        return np.sqrt(np.mean(self.flat_jacobian**2, axis=0))

    def with_residual(self, residual: Array) -> "Linearisation":
        """Returns the same derivatives, with other residuals (rows, channels)."""
        weights = huber_weights(residual, self.huber_delta)
        return dataclasses.replace(self, residual=residual, weights=weights)

    def of_first(self, count: int) -> "Linearisation":
        """Returns the same of the first parameters alone."""
        if count == len(self.u):
            return self
        jacobian = self.jacobian[..., :count]
        return dataclasses.replace(self, u=self.u[:count], jacobian=jacobian)


def linearise(
    objective: Objective,
    u: Array,
    steps: Array | None = None,
    central: bool = True,
    residual: Array | None = None,
) -> Linearisation:
    """Returns the linearisation at a point (p,) of the unit box.

    Args:
        objective: whose residuals.
        u: where.
        steps: (p,) of the differences, in the unit box.
        central: central differences, 2 p + 1 evaluations, one-sided at a bound; or
            all one-sided, p + 1 evaluations, of the objective's `differences`.
        residual: (rows, channels) there, if it is known; saves an evaluation of
            one-sided differences.
    """
    size = len(u)
    steps = _first_steps(objective.model.parameters) if steps is None else steps
    if not central:
        return extend(_at(objective, u, residual), objective, u, steps)
    ahead = np.clip(u + np.diag(steps), 0.0, 1.0)
    behind = np.clip(u - np.diag(steps), 0.0, 1.0)
    points = np.vstack([u[None], ahead, behind])
    found = np.array(objective.residuals(objective.scaling.from_unit(points)))
    way = np.diagonal(ahead - behind)
    difference = found[1 : size + 1] - found[size + 1 :]
    jacobian = np.moveaxis(difference / way[:, None, None], 0, -1)
    weights = huber_weights(found[0], objective.huber_delta)
    return Linearisation(u, found[0], jacobian, weights, objective.huber_delta)


def linearise_again(
    before: Linearisation,
    objective: Objective,
    u: Array,
    steps: Array,
    residual: Array,
) -> Linearisation:
    """Returns the linearisation at another point (p,), by one-sided differences.

    Of an affine model, derivatives by its own parameters are the same everywhere,
    unless an effect shifts them: the first tells.

    Args:
        before: at a point before.
        objective: whose residuals.
        u: the point.
        steps: (p,) of the differences, in the unit box.
        residual: (rows, channels) there.
    """
    start = _at(objective, u, residual)
    own = sum(not field_of(p) for p in objective.model.parameters)
    if not objective.model.affine or own < 2:
        return extend(start, objective, u, steps)
    way = -steps[0] if u[0] > 0.5 else steps[0]
    there = objective.scaling.from_unit(u + way * (np.arange(len(u)) == 0))
    first = (objective.residuals(there)[0] - residual) / way
    known = before.jacobian[..., :own]
    change = np.abs(first - known[..., 0]).max()
    if change > _SAME * np.abs(known[..., 0]).max():
        return extend(start, objective, u, steps)
    start = dataclasses.replace(start, u=u[:own], jacobian=known)
    return extend(start, objective, u, steps[own:])


def extend(
    linearisation: Linearisation,
    objective: Objective,
    u: Array,
    steps: Array | None = None,
    deadline: float = math.inf,
    kept: Kept | None = None,
) -> Linearisation:
    """Returns a linearisation with more parameters, one evaluation for each.

    Args:
        linearisation: with the first parameters, at this point.
        objective: of all parameters, with the same residuals there.
        u: (p,) the point.
        steps: (k,) of the one-sided differences by the new ones, away from the bound
            that is nearer.
        deadline: by `time.monotonic` [s]: parameters whose turn comes later are left
            out; the first few never are.
        kept: gets points (k, p) and what finds the residuals there, some at a time;
            returns them, and may have kept them of a run that was stopped.
    """
    known = len(linearisation.u)
    if steps is None:
        steps = _first_steps(objective.model.parameters[known:])
    if not len(steps):
        return linearisation
    way = np.where(u[known:] > 0.5, -steps, steps)
    points = np.tile(u, (len(way), 1))
    points[:, known:] += np.diag(way)
    source, origin = objective.differences, linearisation.residual
    at_origin = u[None] if source is not objective else u[None][:0]
    rows, channels, _ = linearisation.jacobian.shape
    jacobian = np.empty((rows, channels, len(u)))  # once: of hundreds of columns
    jacobian[..., :known] = linearisation.jacobian
    done = known
    size = max(_BETWEEN_LOOKS, source.model.together)
    for part in parts_until(deadline, len(points), size, is_whole=kept is None):
        thetas = objective.scaling.from_unit(np.vstack([points[part], at_origin]))
        find = functools.partial(source.residuals, thetas)
        found = kept(thetas, find) if kept else find()
        if len(at_origin):
            origin = found.pop()
        for residual in found:
            jacobian[..., done] = (residual - origin) / way[done - known]
            done += 1
    return dataclasses.replace(linearisation, u=u, jacobian=jacobian).of_first(done)


def _first_steps(parameters: Sequence[Parameter]) -> Array:
    """Returns steps (p,) of the unit box with which nothing is known yet."""
    return np.array(
        [
            p.first_step / (p.high - p.low) if p.first_step else FIRST_STEP
            for p in parameters
        ]
    )


def _at(objective: Objective, u: Array, residual: Array | None) -> Linearisation:
    """Returns the residuals at a point (p,), with no parameter."""
    if residual is None:
        residual = objective.residuals(objective.scaling.from_unit(u))[0]
    weights = huber_weights(residual, objective.huber_delta)
    nothing = np.zeros((*residual.shape, 0))
    return Linearisation(u[:0], residual, nothing, weights, objective.huber_delta)


def fitting_steps(linearisation: Linearisation) -> Array:
    """Returns steps (p,) that just show in the residuals, for the next linearisation.

    A parameter that the log determines to a millionth of its range needs a far smaller
    step than one that it hardly determines. Far from the optimum, where residuals are
    large, contact is made and lost along a step; a longer step averages over that.
    """
    level = np.sqrt(np.mean(linearisation.weights * linearisation.residual**2))
    J, w = linearisation.jacobian, linearisation.weights
    norm = np.sqrt(np.einsum("rcp,rc,rcp->p", J, w, J))
    steps = _NOTICEABLE * max(1.0, float(level)) / np.maximum(norm, 1e-300)
    return np.clip(steps, _LEAST_STEP, WIDE_STEP)
