"""The Markov decision process: state, reward and termination, as pure functions.

Description: slide the bolt from A to B along the groove, then lift it out.
Randomisation: imprecision psi on the action (algorithm 3.2), sensor noise.
Success: `travelled` (x - x0 > 55 mm, chapter 3) or `removed` (the head's underside
2 mm above the plate, chapter 4); more than the safety force or torque is failure.
"""

import dataclasses
import enum
from typing import Self

import numpy as np

from drake_disasm.scenario import TaskConfig

_MM = 1000.0  # the reward speaks millimetres, because the thesis does

STATE_NAMES = ("x", "y", "z", "u", "v", "w", "fx", "fy", "fz", "tx", "ty", "tz")
ACTION_NAMES = ("dx", "dy", "dz", "du", "dv", "dw")
REWARD_TERMS = ("progress", "force", "torque", "lift")


@dataclasses.dataclass(frozen=True)
class BoltState:
    """What the agent sees, all in the groove's nominal frame G.

    Attributes:
        p: (3,) displacement of Bo since the start of the episode [m].
        r: (3,) rotation vector of B since then [rad].
        f, t: (3,) force and torque of the environment on the bolt at Bo [N, N m].
    """

    p: np.ndarray
    r: np.ndarray
    f: np.ndarray
    t: np.ndarray

    @classmethod
    def from_vector(cls, s: np.ndarray) -> Self:
        """Returns the state of an observation (12,), in the order STATE_NAMES."""
        return cls(s[0:3], s[3:6], s[6:9], s[9:12])

    @property
    def force(self) -> float:
        """Magnitude of the force [N]."""
        return float(np.sqrt(self.f @ self.f))

    @property
    def torque(self) -> float:
        """Magnitude of the torque [N m]."""
        return float(np.sqrt(self.t @ self.t))


class Outcome(enum.IntEnum):
    """How an episode stands."""

    RUNNING = 0
    SUCCESS = 1
    FORCE_LIMIT = 2
    TORQUE_LIMIT = 3
    STEP_LIMIT = 4

    @property
    def terminated(self) -> bool:
        """Whether the task itself ended the episode, well or badly."""
        return self in (self.SUCCESS, self.FORCE_LIMIT, self.TORQUE_LIMIT)

    @property
    def truncated(self) -> bool:
        """Whether only the step limit ended it."""
        return self is self.STEP_LIMIT

    @property
    def label(self) -> str:
        """The name as people read it."""
        return self.name.lower().replace("_", " ")


def reward_terms(
    before: BoltState, after: BoltState, task: TaskConfig
) -> dict[str, float]:
    """Returns the weighted reward terms of one step (eq. 3.4 and 4.3) by name."""
    w = task.reward
    dx, dy = _MM * (after.p[:2] - before.p[:2])
    lifting = after.p[0] > task.travel_success and dy > 0.0
    return {
        "progress": w.w_dis * dx,
        "force": -w.w_f * after.force / w.f_max,
        "torque": -w.w_t * after.torque / w.t_max,
        "lift": w.w_y * dy if lifting else 0.0,
    }


def outcome(
    state: BoltState, steps_done: int, task: TaskConfig, lift_needed: float
) -> Outcome:
    """Returns how the episode stands after `steps_done` steps.

    Args:
        state: the newest state.
        steps_done: steps taken so far.
        task: limits and what counts as success.
        lift_needed: rise of the bolt at which it is out [m].
    """
    if state.force > task.reward.f_max:
        return Outcome.FORCE_LIMIT
    if state.torque > task.reward.t_max:
        return Outcome.TORQUE_LIMIT
    if succeeded(state, task, lift_needed):
        return Outcome.SUCCESS
    return Outcome.STEP_LIMIT if steps_done >= task.steps else Outcome.RUNNING


def succeeded(state: BoltState, task: TaskConfig, lift_needed: float) -> bool:
    """Returns whether the task is done."""
    if task.success == "travelled":
        return bool(state.p[0] > task.travel_success)
    return bool(state.p[1] >= lift_needed)


def action_bounds(task: TaskConfig) -> np.ndarray:
    """Returns the largest action (6,) [m, rad]; the smallest is its negative."""
    return np.array([task.max_translation] * 3 + [task.max_rotation] * 3)
