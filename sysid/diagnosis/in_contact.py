"""What rivals predict of experiments in contact, and whether these are safe.

Each experiment is performed on the twin under each rival, for its safety. What rivals
predict is compared under the same actions, those of the first, as a log's model is.
"""

from collections.abc import Sequence

import numpy as np
from pydrake.math import RigidTransform

from drake_disasm.cell.coordinates import ArmCoordinates
from drake_disasm.cell.placement import nominal_groove_pose
from drake_disasm.cell.tool import Tool
from drake_disasm.common.errors import DisasmError, DivergedError, UnreachableError
from drake_disasm.common.progress import Progress, ProgressUpdate, ignore_progress
from drake_disasm.common.spatial import rotation_from_vector
from drake_disasm.experiments import Plan, Replay
from drake_disasm.experiments.performing import (
    Laboratory,
    Performance,
    perform_side_by_side,
)
from drake_disasm.mdp import STATE_NAMES, STATE_UNITS
from drake_disasm.safety import SafetyConfig
from drake_disasm.scenario import Scenario
from drake_disasm.twin.steps import noise_free
from sysid.diagnosis.design import Forecast
from sysid.diagnosis.rivals import AS_IT_IS, TwinRival
from sysid.models.base import Array
from sysid.models.transitions import FORCE_ERROR, POSE_ERROR, POSE_NOISE
from sysid.models.twin import with_impact_as_stiff

_MARGIN = 0.7  # of the greatest force and torque that a task allows
_EVERY = 4  # steps of an experiment at which joint limits are looked at
_LEVER = 0.02  # m, at which an error of the force turns the bolt


def twin_forecasts(
    plans: Sequence[Plan],
    rivals: Sequence[TwinRival],
    limits: SafetyConfig | None = None,
    progress: Progress = ignore_progress,
) -> list[Forecast]:
    """Returns what rivals predict of experiments.

    Args:
        plans: experiments on the rivals' scenario.
        rivals: each a scenario.
        limits: at which the station holds, if it does.
        progress: gets each simulation.
    """
    led = _performed(plans, [rival.scenario for rival in rivals], progress)
    replayed = _replayed(plans, led[0], rivals, progress)
    noise, reach = _noise(rivals[0].scenario), _Reach(rivals[0].scenario)
    found = []
    for number, plan in enumerate(plans):
        done = [own[number] for own in led]
        same = [[twin[number].observations for twin in own] for own in replayed]
        steps = min(len(each) for own in same for each in own)
        error = _own_error(np.mean([own[0][:steps] for own in same], axis=0))
        sigma = np.hypot(noise, error)
        signals = [[x[:steps] / sigma for x in own] for own in same]
        spread = np.ptp([own[0] for own in signals], axis=0)
        i = int(np.argmax(np.sum(spread**2, axis=0)))
        duration = max(each.duration for each in done)
        forces, torques = zip(*(each.greatest for each in done), strict=True)
        found.append(
            Forecast(
                plan,
                duration,
                (max(forces), max(torques)),
                signals,
                STATE_NAMES[i],
                STATE_UNITS[i],
                [own[0][:, i] for own in same],
                plan.period,
                _hazard(done, rivals, reach, limits),
                error / sigma,
            )
        )
    return found


def _replayed(
    plans: Sequence[Plan],
    performed: Sequence[Performance],
    rivals: Sequence[TwinRival],
    progress: Progress,
) -> list[list[list[Performance]]]:
    """Returns what rivals predict under the actions with which plans were performed.

    Of each rival its own, and one for each parameter that is moved; of each all plans.
    """
    replays = [
        Plan(plan.experiment, (Replay(one.actions),), plan.period)
        for plan, one in zip(plans, performed, strict=True)
    ]
    twins = [each for rival in rivals for each in (rival.scenario, *rival.varied)]
    repeated = iter(_performed(replays, twins, progress))
    return [
        [next(repeated) for _ in (rival.scenario, *rival.varied)] for rival in rivals
    ]


def forecasts_as_it_is(
    plans: Sequence[Plan],
    scenario: Scenario,
    limits: SafetyConfig | None = None,
    progress: Progress = ignore_progress,
) -> list[Forecast]:
    """Returns what the model alone predicts of experiments; see `twin_forecasts`."""
    alone = [TwinRival(AS_IT_IS, 1.0, 0.0, scenario)]
    return twin_forecasts(plans, alone, limits, progress)


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


def _noise(scenario: Scenario) -> Array:
    """Returns the standard deviations (12,) of what is measured of a state."""
    sensor = scenario.ft_sensor
    noise = np.hypot(sensor.noise, np.array(sensor.quantum) / np.sqrt(12.0))
    m, rad = POSE_NOISE
    return np.repeat([m, rad, noise[:3].max(), noise[3:].max()], 3)


def _own_error(states: Array) -> Array:
    """Returns those of the model's own error (n, 12) in states (n, 12)."""
    least, share = FORCE_ERROR
    change = np.diff(states[:, 6:9], axis=0, prepend=states[:1, 6:9])
    force = np.hypot(least, share * np.linalg.norm(change, axis=1))
    pose = np.ones_like(force)[:, None] * POSE_ERROR
    error = np.column_stack([pose, force, _LEVER * force])
    return np.repeat(error, 3, axis=1)


def _hazard(
    done: Sequence[Performance],
    rivals: Sequence[TwinRival],
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
            return f"under {rival.name} it ends by {each.ended}; see task.reward"
        if force > most_force or torque > most_torque:
            return (
                f"under {rival.name} it presses by {force:.1f} N and {torque:.2f} N m, "
                f"above {100 * _MARGIN:.0f} % of what is allowed; see f_max and t_max "
                "of task.reward, on hardware safety, too"
            )
        if limits and not is_within(limits, each.observations[:, :3]):
            return (
                f"under {rival.name} it comes near the sides of the workspace; see "
                "safety.workspace_*"
            )
        if beyond := reach.beyond(each.observations):
            return f"under {rival.name} {beyond}"
    return ""


def is_within(limits: SafetyConfig, path: Array) -> bool:
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
