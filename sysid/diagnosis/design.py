"""Which experiment separates rivals best, and whether it is safe under each of them.

Each experiment is performed on the twin under each rival, for its safety. What rivals
predict is compared under the same actions, those of the first, as a log's model is.

Two rivals are as far apart as what a station would measure differs, d, in standard
deviations of the sensor's noise and of the model's own error, whichever of them is
true, and with the other fitted to that as far as the log lets its parameters go
(T-optimality: Atkinson and Fedorov, "The design of experiments for discriminating
between two rival models", 1975). A verdict tells them apart once one leaves enough more
of the loss, d0^2. So whoever chooses between them errs with a probability of at most
sqrt(w1 w2) exp(-2 (d / d0)^2), which with d0 = 4 is the bound of Kailath ("The
divergence and Bhattacharyya distance measures in signal selection", 1967). The best
experiment takes most of that away per second of robot time, with what lies between two
experiments. That none helps is said only if none would with all parameters known.
"""

import dataclasses
import itertools
import math
from collections.abc import Mapping, Sequence

import numpy as np
from pydrake.math import RigidTransform

from drake_disasm.cell.coordinates import ArmCoordinates
from drake_disasm.cell.placement import nominal_groove_pose
from drake_disasm.cell.tool import Tool
from drake_disasm.common.errors import DisasmError, DivergedError, UnreachableError
from drake_disasm.common.progress import Progress, ProgressUpdate
from drake_disasm.common.spatial import rotation_from_vector
from drake_disasm.experiments import Plan, Replay
from drake_disasm.experiments.performing import (
    Laboratory,
    Performance,
    perform_side_by_side,
)
from drake_disasm.safety import SafetyConfig
from drake_disasm.scenario import Scenario
from drake_disasm.twin.steps import noise_free
from sysid.diagnosis.rivals import BY_CHANCE, Need, Rival
from sysid.models.base import Array
from sysid.models.transitions import FORCE_ERROR, POSE_NOISE
from sysid.models.twin import with_impact_as_stiff

_MARGIN = 0.7  # of the greatest force and torque that a task allows
_LOOKED_AT = 8  # experiments, of which the best is likely to be one
_EVERY = 4  # steps of an experiment at which joint limits are looked at
_BETWEEN = 20.0  # s from one to the next: the way back, zeroing, a verdict
_LEVER = 0.02  # m, at which an error of the force turns the bolt


@dataclasses.dataclass(frozen=True)
class Prediction:
    """What rivals predict of an experiment.

    Attributes:
        plan: of the experiment.
        performances: of each rival, on the twin.
        replayed: of each rival, with the actions of the first rival's.
        distances: (k, k) between rivals, in standard deviations.
        bounds: (k, k) the same if their parameters were known.
        needed: (k, k) at which a verdict would tell them apart.
        sigma: (12,) by which a measured state may differ anyway.
        hazard: why it is not performed, in words; empty if it may be.
        value: error probability that it takes away, per second.
    """

    plan: Plan
    performances: tuple[Performance, ...]
    replayed: tuple[Performance, ...]
    distances: Array
    bounds: Array
    needed: Array
    sigma: Array
    hazard: str
    value: float

    @property
    def duration(self) -> float:
        """Robot time under the rival that takes longest [s]."""
        return max(each.duration for each in self.performances)

    @property
    def channel(self) -> int:
        """Number of the state's channel in which rivals differ most."""
        steps = min(len(each.observations) for each in self.replayed)
        states = np.array([each.observations[:steps] for each in self.replayed])
        return int(np.argmax(np.sum(np.ptp(states / self.sigma, axis=0) ** 2, axis=0)))

    @property
    def is_helpful(self) -> bool:
        """Whether it is safe, and may show two rivals to differ."""
        return not self.hazard and float(self.bounds.max(initial=0.0)) >= BY_CHANCE

    @property
    def farthest(self) -> float:
        """Distance of the two rivals that it separates best."""
        return float(self.distances.max(initial=0.0))


def predict(
    plans: Sequence[Plan],
    rivals: Sequence[Rival],
    need: Need,
    progress: Progress,
    limits: SafetyConfig | None = None,
    trust: Mapping[str, float] | None = None,
) -> list[Prediction]:
    """Returns what rivals predict of experiments, the best first.

    Those that would be best if the rivals' parameters were known are looked at; the
    others only if these are not enough.

    Args:
        plans: experiments on the rivals' scenario.
        rivals: at least two.
        need: how far apart they have to be.
        progress: gets each simulation.
        limits: at which the station holds, if it does.
        trust: in the distances of a class of experiments, by its name; 1 if left out.
    """
    trust = trust or {}
    known = [dataclasses.replace(rival, varied=()) for rival in rivals]
    quick = _predictions(plans, known, need, progress, limits, trust)

    def exact(those: list[Prediction]) -> list[Prediction]:
        """Returns the same, with what is uncertain of the rivals' parameters."""
        if not any(rival.varied for rival in rivals):
            return those
        chosen = [each.plan for each in those]
        return _predictions(chosen, rivals, need, progress, limits, trust)

    found, rest = exact(quick[:_LOOKED_AT]), quick[_LOOKED_AT:]
    if rest and not is_enough(found, rivals, need, math.inf):
        found += exact(rest)
    return sorted(found, key=lambda each: -each.value)


def _predictions(
    plans: Sequence[Plan],
    rivals: Sequence[Rival],
    need: Need,
    progress: Progress,
    limits: SafetyConfig | None,
    trust: Mapping[str, float],
) -> list[Prediction]:
    """Returns what rivals predict of experiments, the best first; see `predict`."""
    led = _performed(plans, [rival.scenario for rival in rivals], progress)
    replays = [
        Plan(plan.experiment, (Replay(one.actions),), plan.period)
        for plan, one in zip(plans, led[0], strict=True)
    ]
    twins = [each for rival in rivals for each in (rival.scenario, *rival.varied)]
    repeated = iter(_performed(replays, twins, progress))
    replayed = [
        [next(repeated) for _ in (rival.scenario, *rival.varied)] for rival in rivals
    ]
    weights = np.array([rival.weight for rival in rivals])
    sigma, reach = _sigma(rivals[0].scenario), _Reach(rivals[0].scenario)
    found = []
    for number, plan in enumerate(plans):
        done = tuple(own[number] for own in led)
        same = [[twin[number] for twin in own] for own in replayed]
        duration = max(each.duration for each in done)
        name = type(plan.experiment).__name__
        distances = trust.get(name, 1.0) * _distances(same, sigma, weights)
        bounds = _distances([own[:1] for own in same], sigma, weights)
        hazard = _hazard(done, rivals, reach, limits)
        needed = need.distances(rivals, round(duration / plan.period))
        gain = 0.0 if hazard else _gain(distances / needed, weights)
        value = gain / (duration + _BETWEEN)
        shown = tuple(own[0] for own in same)
        found.append(
            Prediction(
                plan, done, shown, distances, bounds, needed, sigma, hazard, value
            )
        )
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


def _performed(
    plans: Sequence[Plan], scenarios: Sequence[Scenario], progress: Progress
) -> list[list[Performance]]:
    """Returns experiments on each of some twins.

    All at once with IMPACT contact, as stiff as their own, where they have such a form.
    """
    twins = [noise_free(each) for each in scenarios]
    try:
        batch = [as_batch(each) for each in twins]
        return perform_side_by_side(batch, plans, progress)
    except DisasmError:  # an effect or a part that the batch does not have
        if len(twins) == 1:
            return [_one_by_one(plans, twins[0], progress)]
    return [own for each in twins for own in _performed(plans, [each], progress)]


def _one_by_one(
    plans: Sequence[Plan], scenario: Scenario, progress: Progress
) -> list[Performance]:
    """Returns each experiment on the diagram's twin."""
    laboratory, found = Laboratory(scenario, "twin"), []
    for number, plan in enumerate(plans):
        progress(ProgressUpdate("predicting", number, len(plans), plan.text))
        try:
            found.append(laboratory.perform(plan))
        except (DivergedError, UnreachableError) as error:
            nothing = np.zeros((1, 12)), np.zeros((0, 6))
            found.append(Performance(*nothing, str(error), plan.period))
    return found


def _sigma(scenario: Scenario) -> Array:
    """Returns the standard deviations (12,) of what a state would differ by anyway."""
    sensor = scenario.ft_sensor
    noise = np.hypot(sensor.noise, np.array(sensor.quantum) / np.sqrt(12.0))
    force = np.hypot(noise[:3].max(), FORCE_ERROR[0])
    torque = np.hypot(noise[3:].max(), _LEVER * FORCE_ERROR[0])
    m, rad = POSE_NOISE
    return np.repeat([m, rad, force, torque], 3)


def _distances(
    of_rivals: Sequence[Sequence[Performance]], sigma: Array, weights: Array
) -> Array:
    """Returns how far rivals are apart (k, k), over the steps that all have.

    One of two is true; the other is fitted to what comes out, with the covariance
    1 + J J^T in units of sigma: J is how it changes with its parameters, by a standard
    deviation of each. The mean square over which is true, by their weights.

    Args:
        of_rivals: of each its own performance, and one for each parameter.
        sigma: (12,) of a state.
        weights: (k,).
    """
    steps = min(len(each.observations) for own in of_rivals for each in own)
    whitened = [
        np.array([(each.observations[:steps] / sigma).ravel() for each in own])
        for own in of_rivals
    ]
    found = np.zeros((len(whitened), len(whitened)))
    for i, j in itertools.combinations(range(len(whitened)), 2):
        (one, *more), (other, *others) = whitened[i], whitened[j]
        away, both = one - other, weights[i] + weights[j]
        if_one = mahalanobis(away, np.array([x - other for x in others]))
        if_other = mahalanobis(away, np.array([x - one for x in more]))
        squared = weights[i] * if_one**2 + weights[j] * if_other**2
        found[i, j] = found[j, i] = np.sqrt(squared / both)
    return found


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


def _hazard(
    done: Sequence[Performance],
    rivals: Sequence[Rival],
    reach: "_Reach",
    limits: SafetyConfig | None,
) -> str:
    """Returns why an experiment is not safe under every rival; empty if it is."""
    reward = rivals[0].scenario.task.reward
    most_force, most_torque = _MARGIN * reward.f_max, _MARGIN * reward.t_max
    if limits:
        most_force = min(most_force, _MARGIN * limits.max_force)
        most_torque = min(most_torque, _MARGIN * limits.max_torque_xy)
    for each, rival in zip(done, rivals, strict=True):
        force, torque = each.greatest
        if each.ended:
            return f"under {rival.name} it ends by {each.ended}"
        if force > most_force or torque > most_torque:
            return (
                f"under {rival.name} it presses by {force:.1f} N and {torque:.2f} N m, "
                f"above {100 * _MARGIN:.0f} % of what is allowed"
            )
        if limits and not _is_within(limits, each.observations[:, :3]):
            return (
                f"under {rival.name} it comes near the sides of the workspace; see "
                "safety.workspace_*"
            )
        if beyond := reach.beyond(each.observations):
            return f"under {rival.name} {beyond}"
    return ""


def _is_within(limits: SafetyConfig, path: Array) -> bool:
    """Returns whether a path (n, 3) keeps off the workspace's sides, twice as far."""
    margin = 2.0 * limits.workspace_margin
    low = np.array(limits.workspace_low) + margin
    high = np.array(limits.workspace_high) - margin
    return bool(np.all((low <= path) & (path <= high)))


def as_batch(scenario: Scenario) -> Scenario:
    """Returns a scenario with IMPACT contact, as stiff as its own."""
    if scenario.contact.model == "impact" or scenario.part.gaps is None:
        return scenario
    return with_impact_as_stiff(scenario)


class _Reach:
    """Whether the arm gets everywhere within its joint limits.

    Args:
        scenario: of the arm.
    """

    def __init__(self, scenario: Scenario) -> None:
        X_FB = Tool.from_models(scenario).X_FB
        X_WG = nominal_groove_pose(scenario.placement)
        period = _EVERY * scenario.task.period
        self._arm = ArmCoordinates(scenario.arm, X_WG, X_FB, period)

    def beyond(self, observations: Array) -> str:
        """Returns where it doesn't, in words; empty if it does."""
        q = self._arm.start(RigidTransform())
        try:
            for x in observations[::_EVERY]:
                R_GB = rotation_from_vector(x[3:6])
                q = self._arm.solve(RigidTransform(R_GB, x[:3]), q)
        except DisasmError as error:
            return str(error)
        return ""
