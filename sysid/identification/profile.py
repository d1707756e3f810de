"""Profile likelihood: the best fits with one parameter held at several values."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from sysid import confidence
from sysid.identification.gauss_newton import gauss_newton
from sysid.objective import Objective
from sysid.workers import Workers

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Profile:
    """The objective along one parameter, all others fitted again.

    Attributes:
        name: of the parameter.
        theta: (k,) values at which it was held.
        values: (k,) of the objective.
        edge: value of the objective at the end of the 95 % interval.
    """

    name: str
    theta: Array
    values: Array
    edge: float


def profile(
    objective: Objective,
    workers: Workers,
    u: Array,
    name: str,
    half_width: float,
    points: int = 7,
    callback: Callable[[int, int], None] | None = None,
) -> Profile:
    """Returns the profile of a parameter about an optimum.

    Args:
        objective: that was minimised.
        workers: to evaluate with.
        u: (p,) the optimum in the unit box.
        name: of the parameter.
        half_width: of the interval of values, in the unit box.
        points: how many values.
        callback: called with the number of points that are done, and of all.
    """
    model = objective.model
    number = [p.name for p in model.parameters].index(name)
    best = objective.value(objective.residuals(objective.scaling.from_unit(u))[0])
    low, high = max(0.0, u[number] - half_width), min(1.0, u[number] + half_width)
    held = np.linspace(low, high, points)
    values = []
    for i, value in enumerate(held):
        there = u.copy()
        there[number] = value
        theta = float(objective.scaling.from_unit(there)[number])
        rest = Objective(model.freeze({name: theta}), workers, objective.huber_delta)
        values.append(_fitted(rest, np.delete(there, number)))
        if callback:
            callback(i + 1, points)
    thetas = u + (held[:, None] - u[number]) * np.eye(len(u))[number]
    size = model.measurements.values.size
    edge = best * np.sqrt(1.0 + chi2.ppf(confidence.LEVEL, 1) / size)
    return Profile(
        name,
        objective.scaling.from_unit(thetas)[:, number],
        np.array(values),
        float(edge),
    )


def _fitted(objective: Objective, u: Array) -> float:
    if not len(u):
        return float(objective(np.zeros((1, 0)))[0])
    return objective.value(gauss_newton(objective, u, 3).residual)
