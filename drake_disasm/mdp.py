"""The Markov decision process: state, reward and termination, as pure functions.

Description: move the bolt along the stages of its part's way (`Part.stages`): from A
to B along a door chain's groove, then out of it.
Randomisation: imprecision psi on the action (algorithm 3.2), sensor noise.
Success: `travelled` (x - x0 > 55 mm, chapter 3) or `removed` (the last stage is done:
a head's underside 2 mm above the plate, chapter 4); more than the safety force or
torque is failure, and so is a bolt outside the workspace.

A simulation judges `removed` by where the bolt truly is. Hardware knows its place to
half a millimetre while the arm moves: there it is removed once it has been pulled
`PULL_AWAY` further, and nothing holds it.

The reward is the thesis's where the bolt goes on and up. Where it goes elsewhere it
closes two holes, each worth more than the task itself: progress counts up to the
groove's end only (or a bolt just below the height of success flies on along x), and
what rising has paid, falling takes back (or it moves up and down until time is up).

All of it is about where the bolt is. A gripper that yields lets the arm go on without
it: pulled up by 4 N, a bolt under the lips would look removed. So the bolt's place is
the measured one plus what the measured wrench makes it yield (`TaskGeometry.place`).
"""

import dataclasses
import enum
from typing import Any, Self

import numpy as np

from drake_disasm.cell.grip import bolt_compliance
from drake_disasm.common.arrays import (
    Array,
    apply_matrix,
    as_number,
    namespace,
    side_by_side,
)
from drake_disasm.parts import AXES
from drake_disasm.scenario import Scenario, TaskConfig

_MM = 1000.0  # the reward speaks millimetres, because the thesis does
#: Way beyond the last stage [m], and force there [N], that show a bolt to be free.
PULL_AWAY, FREE_FORCE = 0.001, 2.0

STATE_NAMES = ("x", "y", "z", "u", "v", "w", "fx", "fy", "fz", "tx", "ty", "tz")
STATE_UNITS = (*("m",) * 3, *("rad",) * 3, *("N",) * 3, *("N m",) * 3)
ACTION_NAMES = ("dx", "dy", "dz", "du", "dv", "dw")
REWARD_TERMS = ("progress", "force", "torque", "lift")


@dataclasses.dataclass(frozen=True)
class BoltState:
    """What the agent sees, all in the groove's nominal frame G.

    Attributes:
        p: (..., 3) displacement of Bo since the start of the episode, as the arm's
            encoders have it: in a grip that yields the bolt is elsewhere [m].
        r: (..., 3) rotation vector of B since then [rad].
        f, t: (..., 3) force and torque of the environment on the bolt at Bo [N, N m].
    """

    p: Array
    r: Array
    f: Array
    t: Array

    @classmethod
    def from_vector(cls, s: Array) -> Self:
        """Returns the state of observations (..., 12), in the order STATE_NAMES."""
        return cls(s[..., 0:3], s[..., 3:6], s[..., 6:9], s[..., 9:12])

    @property
    def force(self) -> Any:
        """Magnitude of the force [N]; a number, or (...,)."""
        return _length(self.f)

    @property
    def torque(self) -> Any:
        """Magnitude of the torque [N m]; a number, or (...,)."""
        return _length(self.t)


class Outcome(enum.IntEnum):
    """How an episode stands."""

    RUNNING = 0
    SUCCESS = 1
    FORCE_LIMIT = 2
    TORQUE_LIMIT = 3
    STEP_LIMIT = 4
    WORKSPACE = 5  # after the others: logs and files have the numbers

    @property
    def terminated(self) -> bool:
        """Whether the task itself ended the episode, well or badly."""
        return is_terminated(self)

    @property
    def truncated(self) -> bool:
        """Whether only the step limit ended it."""
        return is_truncated(self)

    @property
    def label(self) -> str:
        """The name as people read it."""
        return self.name.lower().replace("_", " ")


def is_terminated(outcomes: Any) -> Any:
    """Returns whether the task itself ended episodes, of numbers of `Outcome`."""
    return (outcomes != Outcome.RUNNING) & (outcomes != Outcome.STEP_LIMIT)


def is_truncated(outcomes: Any) -> Any:
    """Returns whether only the step limit ended them."""
    return outcomes == Outcome.STEP_LIMIT


@dataclasses.dataclass(frozen=True)
class TaskGeometry:
    """Where a task happens: the way out of the part, and the workspace around.

    Attributes:
        way: the bolt's coordinates (`AXES`) along and about which it leaves, a letter
            for each stage: "xy" of a door chain.
        ends: where each stage ends [m, rad]; the last with the task's margin.
        radii: at which turns are counted [m]; 1 where a stage is none.
        low, high: (3,) of the workspace: the displacement of the bolt from the start,
            in G, beyond which an episode has failed [m].
        compliance: (3, 6) displacement of Bo in the grip by the wrench [f; tau] on
            the bolt at Bo, in G [m/N, m/(N m)].
        turning: (3, 6) rotation of B in the grip likewise [rad/N, rad/(N m)].

    Of n tasks each but `way` has n as an axis before these shapes.
    """

    way: str
    ends: tuple[float | Array, ...]
    radii: tuple[float | Array, ...]
    low: Array
    high: Array
    compliance: Array
    turning: Array

    @classmethod
    def of(cls, scenario: Scenario, compliance: Array | None = None) -> Self:
        """Returns the geometry of a scenario, without its effects.

        Args:
            scenario: of the task.
            compliance: (6, 6) of the grip, if it is known: finding it takes time.
        """
        stages, room = scenario.part.stages, np.array(scenario.task.room)
        ends = [stage.end for stage in stages]
        ends[-1] += scenario.task.lift_success
        high = np.zeros(6)
        for stage, end in zip(stages, ends, strict=True):
            high[stage.axis] = end
        if compliance is None:
            compliance = bolt_compliance(scenario)
        radii = tuple(stage.radius for stage in stages)
        low, high = -room, high[:3] + room
        way = scenario.part.way
        return cls(way, tuple(ends), radii, low, high, compliance[:3], compliance[3:])

    def ways(self, state: BoltState) -> list[Any]:
        """Returns how far the bolt has gone along each stage's axis (...,) [m].

        A turn counts at its radius.
        """
        found, p = [], self.place(state)
        for axis, radius in zip(map(AXES.index, self.way), self.radii, strict=True):
            if axis < 3:
                found.append(p[..., axis])
                continue
            wrench = namespace(state.f).concat([state.f, state.t], axis=-1)
            turned = state.r + apply_matrix(self.turning, wrench)
            found.append(radius * turned[..., axis - 3])
        return found

    def place(self, state: BoltState) -> Array:
        """Returns where Bo is since the start (..., 3) [m], grip included."""
        wrench = namespace(state.f).concat([state.f, state.t], axis=-1)
        return state.p + apply_matrix(self.compliance, wrench)


def _length(vectors: Array) -> Any:
    """Returns the length of vectors (..., 3): a number, or (...,)."""
    xp = namespace(vectors)
    return as_number(xp.sqrt(xp.sum(vectors * vectors, axis=-1)))


def reward_terms(
    before: BoltState, after: BoltState, task: TaskConfig, geometry: TaskGeometry
) -> dict[str, Any]:
    """Returns the weighted reward terms of one step by name, numbers or (...,).

    They are those of eq. 3.4 and 4.3 as long as the bolt goes on and up; see the
    module for where they are not.
    """
    w = task.reward
    gained = _MM * (counts(after, task, geometry) - counts(before, task, geometry))
    progress, rise = as_number(gained[..., 0]), as_number(gained[..., 1])
    return {
        "progress": w.w_dis * progress,
        "force": -w.w_f * after.force / w.f_max,
        "torque": -w.w_t * after.torque / w.t_max,
        "lift": w.w_y * rise,
    }


def counts(state: BoltState, task: TaskConfig, geometry: TaskGeometry) -> Array:
    """Returns the ways along both stages [m] that the reward counts, (..., 2).

    The first counts up to its end, the second from `task.travel_success` of the first.
    """
    first, *others = geometry.ways(state)
    xp, end = namespace(first), geometry.radii[0] * geometry.ends[0]
    way = xp.where(first < end, first, end)
    if not others:
        return side_by_side([way, xp.zeros_like(way)])
    second = xp.where(first > task.travel_success, others[0], 0.0)
    return side_by_side([way, second])


def outcome(
    state: BoltState,
    steps_done: int,
    task: TaskConfig,
    geometry: TaskGeometry,
    p_GBo: Array | None = None,
) -> Outcome:
    """Returns how the episode stands after `steps_done` steps.

    Args:
        state: the newest state.
        steps_done: steps taken so far.
        task: limits and what counts as success.
        geometry: the way out.
        p_GBo: (3,) where the bolt truly is in the true groove; None: nobody knows.
    """
    return Outcome(int(outcomes(state, steps_done, task, geometry, p_GBo)))


def outcomes(
    state: BoltState,
    steps_done: int | Array,
    task: TaskConfig,
    geometry: TaskGeometry,
    p_GBo: Array | None = None,
) -> Array:
    """Returns the numbers (...,) of the outcomes of states; see `outcome`."""
    xp = namespace(state.p)
    found = xp.where(
        within_workspace(state, geometry), Outcome.RUNNING, Outcome.WORKSPACE
    )
    is_last = (steps_done >= task.steps) & (found == Outcome.RUNNING)
    found = xp.where(is_last, Outcome.STEP_LIMIT, found)
    found = xp.where(succeeded(state, task, geometry, p_GBo), Outcome.SUCCESS, found)
    has_turned = xp.asarray(state.torque > task.reward.t_max)
    found = xp.where(has_turned, Outcome.TORQUE_LIMIT, found)
    has_pushed = xp.asarray(state.force > task.reward.f_max)
    return xp.where(has_pushed, Outcome.FORCE_LIMIT, found)


def succeeded(
    state: BoltState,
    task: TaskConfig,
    geometry: TaskGeometry,
    p_GBo: Array | None = None,
) -> Array:
    """Returns whether the task is done (...,); see `outcome`."""
    if task.success == "travelled":
        return geometry.ways(state)[0] > task.travel_success
    if p_GBo is not None:
        return is_removed(p_GBo, geometry)
    axis = AXES.index(geometry.way[-1])
    force = state.f[..., axis]
    is_free = (force > -FREE_FORCE) & (force < FREE_FORCE)
    return is_free & (geometry.ways(state)[-1] >= geometry.ends[-1] + PULL_AWAY)


def is_removed(p_GBo: Array, geometry: TaskGeometry) -> Array:
    """Returns whether a bolt that truly is at p_GBo (..., 3) is out (...,)."""
    return p_GBo[..., AXES.index(geometry.way[-1])] >= geometry.ends[-1]


def within_workspace(state: BoltState, geometry: TaskGeometry) -> Array:
    """Returns whether the bolt is where the task has any business (...,)."""
    p = geometry.place(state)
    is_inside = (geometry.low <= p) & (p <= geometry.high)
    return namespace(p).all(is_inside, axis=-1)


def action_bounds(task: TaskConfig) -> np.ndarray:
    """Returns the largest action (6,) [m, rad]; the smallest is its negative."""
    return np.array([task.max_translation] * 3 + [task.max_rotation] * 3)
