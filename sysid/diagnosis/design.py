"""Which experiment separates rivals best.

Two rivals are as far apart as what would be measured differs, d, in standard deviations
of the sensor's noise and of the model's own error, whichever of them is true, and with
the other fitted to that as far as the log lets its parameters go (T-optimality:
Atkinson and Fedorov, "The design of experiments for discriminating between two rival
models", 1975). A verdict tells them apart once one leaves enough more of the loss,
d0^2. So whoever chooses between them errs with a probability of at most
sqrt(w1 w2) exp(-2 (d / d0)^2), which with d0 = 4 is the bound of Kailath ("The
divergence and Bhattacharyya distance measures in signal selection", 1967). The best
experiment takes most of that away per second of robot time, with what lies between two
experiments. That none helps is said only if none would with all parameters known.
"""

import dataclasses
import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from sysid.diagnosis.rivals import BY_CHANCE, Need, Rival
from sysid.effect_selection.exceeds_noise import lengths_and_errors
from sysid.models.base import Array

_LOOKED_AT = 8  # experiments, of which the best is likely to be one
_BETWEEN = 20.0  # s from one to the next: the way back, zeroing, a verdict


class AnyPlan(Protocol):
    """An experiment that can be performed: a `Plan`, or a `JointPlan`."""

    @property
    def experiment(self) -> Any:
        """With its parameters."""

    @property
    def text(self) -> str:
        """The experiment with its parameters."""


@dataclasses.dataclass(frozen=True)
class Forecast:
    """What rivals predict of an experiment.

    Attributes:
        plan: of the experiment.
        duration: robot time under the rival that takes longest [s].
        greatest: force and torque under any rival [N, N m].
        signals: of each rival its own (n, C), and one for each parameter that is moved
            by a standard deviation; in standard deviations of what is measured anyway.
        channel: in which rivals differ most, with its unit.
        unit: of that.
        shown: of each rival (n,) in that channel.
        period: of its rows [s].
        hazard: why it is not performed, in words; empty if it may be.
        share: (n, C) of these standard deviations that is the model's own error.
    """

    plan: AnyPlan
    duration: float
    greatest: tuple[float, float]
    signals: Sequence[Sequence[Array]]
    channel: str
    unit: str
    shown: Sequence[Array]
    period: float
    hazard: str
    share: Array | float = 0.0

    @property
    def rows(self) -> int:
        """Of a log that are added."""
        return round(self.duration / self.period)


#: Returns what rivals predict of experiments: of each plan, in order.
Forecasts = Callable[[Sequence[Any], Sequence[Rival]], list[Forecast]]


@dataclasses.dataclass(frozen=True)
class Prediction:
    """How well an experiment separates rivals.

    Attributes:
        forecast: what rivals predict of it.
        distances: (k, k) between rivals, in standard deviations.
        bounds: (k, k) the same if their parameters were known.
        needed: (k, k) at which a verdict would tell them apart.
        value: error probability that it takes away, per second.
    """

    forecast: Forecast
    distances: Array
    bounds: Array
    needed: Array
    value: float

    @property
    def plan(self) -> Any:
        """Of the experiment."""
        return self.forecast.plan

    @property
    def duration(self) -> float:
        """Robot time under the rival that takes longest [s]."""
        return self.forecast.duration

    @property
    def hazard(self) -> str:
        """Why it is not performed, in words; empty if it may be."""
        return self.forecast.hazard

    @property
    def is_helpful(self) -> bool:
        """Whether it is safe, and may show two rivals to differ."""
        return not self.hazard and float(self.bounds.max(initial=0.0)) >= BY_CHANCE

    @property
    def farthest(self) -> float:
        """Distance of the two rivals that it separates best."""
        return float(self.distances.max(initial=0.0))


def predict(
    plans: Sequence[AnyPlan],
    rivals: Sequence[Rival],
    need: Need,
    forecasts: Forecasts,
    trust: Mapping[str, float] | None = None,
) -> list[Prediction]:
    """Returns how well experiments separate rivals, the best first.

    Those that would be best if the rivals' parameters were known are looked at; the
    others only if these are not enough.

    Args:
        plans: experiments.
        rivals: at least two.
        need: how far apart they have to be.
        forecasts: what happens in them.
        trust: in the distances of a class of experiments, by its name; 1 if left out.
    """
    trust = trust or {}
    known = [rival.with_known_parameters for rival in rivals]
    quick = _predictions(plans, known, need, forecasts, trust)

    def exact(those: list[Prediction]) -> list[Prediction]:
        """Returns the same, with what is uncertain of the rivals' parameters."""
        if not any(rival.is_uncertain for rival in rivals):
            return those
        chosen = [each.plan for each in those]
        return _predictions(chosen, rivals, need, forecasts, trust)

    found, rest = exact(quick[:_LOOKED_AT]), quick[_LOOKED_AT:]
    if rest and not is_enough(found, rivals, need, math.inf):
        found += exact(rest)
    return sorted(found, key=lambda each: -each.value)


def _predictions(
    plans: Sequence[AnyPlan],
    rivals: Sequence[Rival],
    need: Need,
    forecasts: Forecasts,
    trust: Mapping[str, float],
) -> list[Prediction]:
    """Returns how well experiments separate rivals, the best first; see `predict`."""
    weights = np.array([rival.weight for rival in rivals])
    found = []
    for each in forecasts(plans, rivals):
        name = type(each.plan.experiment).__name__
        signals, own_error = each.signals, need.reach * np.asarray(each.share)
        distances = trust.get(name, 1.0) * _distances(signals, weights, own_error)
        bounds = _distances([own[:1] for own in signals], weights, own_error)
        needed = need.distances(rivals, each.rows)
        gain = 0.0 if each.hazard else _gain(distances / needed, weights)
        value = gain / (each.duration + _BETWEEN)
        found.append(Prediction(each, distances, bounds, needed, value))
    return sorted(found, key=lambda each: -each.value)


def is_enough(
    predictions: Sequence[Prediction],
    rivals: Sequence[Rival],
    need: Need,
    left: float,
) -> bool:
    """Returns whether experiments one after the other may tell two rivals apart.

    Args:
        predictions: of experiments, the best first.
        rivals: of which they are.
        need: how far apart they have to be.
        left: robot time [s]; those are left out that it is too short for.
    """
    squares, enough = np.zeros((len(rivals), len(rivals))), need.distances(rivals, 0)
    for each in predictions:
        if each.is_helpful and each.duration <= left:
            left -= each.duration
            squares += each.bounds**2
    return bool((squares >= enough**2).any())


def _distances(
    signals: Sequence[Sequence[Array]], weights: Array, own_error: Array
) -> Array:
    """Returns how far rivals are apart (k, k).

    One of two is true; the other is fitted to what comes out, with the covariance
    1 + J J^T: J is how it changes with its parameters, by a standard deviation of each.
    The mean square over which is true, by their weights; what is beyond the model's own
    error of it, at most.

    Args:
        signals: see Forecast.
        weights: (k,).
        own_error: (n, C) of the model, in the signals' units.
    """
    found = np.zeros((len(signals), len(signals)))
    for i, j in itertools.combinations(range(len(signals)), 2):
        (one, *more), (other, *others) = signals[i], signals[j]
        away, both = one - other, weights[i] + weights[j]
        flat = away.ravel()
        if_one = mahalanobis(flat, np.array([(x - other).ravel() for x in others]))
        if_other = mahalanobis(flat, np.array([(x - one).ravel() for x in more]))
        squared = weights[i] * if_one**2 + weights[j] * if_other**2
        distance = min(np.sqrt(squared / both), _beyond(away, own_error))
        found[i, j] = found[j, i] = distance
    return found


def _beyond(away: Array, own_error: Array) -> float:
    """Returns the length of what (n, C) is beyond the model's own error.

    In all channels, or in the one that shows it best: see `exceeds_noise_p`.
    """
    lengths, errors = lengths_and_errors(away.reshape(len(away), -1), own_error)
    return float(np.max(lengths - errors, initial=0.0))


def mahalanobis(away: Array, columns: Array) -> float:
    """Returns the length of a vector (n,) with the covariance 1 + J J^T.

    By Woodbury's identity.

    Args:
        away: the vector.
        columns: (p, n), the transpose of J.
    """
    squared = float(away @ away)
    if len(columns):
        inner = np.eye(len(columns)) + columns @ columns.T
        along = columns @ away
        squared -= float(along @ np.linalg.solve(inner, along))
    return float(np.sqrt(max(squared, 0.0)))


def _gain(distances: Array, weights: Array) -> float:
    """Returns by how much an experiment lowers the bound on the error probability.

    Args:
        distances: (k, k) between rivals, as shares of d0.
        weights: (k,).
    """
    pairs = itertools.combinations(range(len(weights)), 2)
    return float(
        sum(
            np.sqrt(weights[i] * weights[j]) * -np.expm1(-2.0 * distances[i, j] ** 2)
            for i, j in pairs
        )
    )
