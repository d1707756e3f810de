"""What experiments are made of: motions that end by time, by place, or by a load.

A phase is a pure function of the observation and of the steps since it began, so that
one experiment can be performed on many stations side by side.
"""

import abc
import dataclasses
import functools
import math

import numpy as np

from drake_disasm.mdp import PULL_AWAY
from drake_disasm.policies.exploring import AXIS_SHARES
from drake_disasm.policies.scripted import make_policy
from drake_disasm.scenario import Scenario
from drake_disasm.systems.policy import Policy

#: A pose (6,) of the bolt: position and rotation vector in G [m, rad]; or an action.
Array = np.ndarray

_ARRIVED = (5e-5, 2e-4)  # m, rad
_SLACK = 10  # steps of a way back beyond those that it takes at full speed


class Phase(abc.ABC):
    """A stretch of an experiment."""

    @abc.abstractmethod
    def act(self, observation: Array, step: int) -> Array | None:
        """Returns the action (6,), or None: it is over.

        Args:
            observation: (12,) the task's state.
            step: number of steps since the phase began.
        """

    @property
    @abc.abstractmethod
    def most_steps(self) -> int:
        """After which it is over in any case."""


@dataclasses.dataclass(frozen=True)
class Move(Phase):
    """Goes on with the same action, until something resists.

    Attributes:
        action: (6,) of each step [m, rad].
        steps: at most.
        effort: resistance along or about the motion at which it ends [N, N m].
    """

    action: tuple[float, ...]
    steps: int
    effort: float = math.inf

    @property
    def most_steps(self) -> int:
        """See Phase."""
        return self.steps

    def act(self, observation: Array, step: int) -> Array | None:
        """See Phase."""
        action = np.array(self.action)
        if step >= self.steps:
            return None
        along = action / np.linalg.norm(action)
        resistance = -float(along @ observation[6:])
        return None if resistance >= self.effort else action


@dataclasses.dataclass(frozen=True)
class Wait(Phase):
    """Stays where it is.

    Attributes:
        steps: how many.
    """

    steps: int

    @property
    def most_steps(self) -> int:
        """See Phase."""
        return self.steps

    def act(self, observation: Array, step: int) -> Array | None:
        """See Phase."""
        return None if step >= self.steps else np.zeros(6)


@dataclasses.dataclass(frozen=True)
class Replay(Phase):
    """Repeats actions, whatever is observed.

    Attributes:
        actions: (n, 6).
    """

    actions: Array

    @property
    def most_steps(self) -> int:
        """See Phase."""
        return len(self.actions)

    def act(self, observation: Array, step: int) -> Array | None:
        """See Phase."""
        return None if step >= len(self.actions) else self.actions[step]


@dataclasses.dataclass(frozen=True)
class Return(Phase):
    """Goes straight to a pose near by.

    Attributes:
        pose: (6,) position and rotation vector in G [m, rad].
        speed: (6,) largest action [m, rad].
        steps: at most.
    """

    pose: tuple[float, ...]
    speed: tuple[float, ...]
    steps: int

    @property
    def most_steps(self) -> int:
        """See Phase."""
        return self.steps

    def act(self, observation: Array, step: int) -> Array | None:
        """See Phase."""
        missing = np.array(self.pose) - observation[:6]
        m, rad = _ARRIVED
        is_there = np.abs(missing[:3]).max() < m and np.abs(missing[3:]).max() < rad
        if is_there or step >= self.steps:
            return None
        speed = np.array(self.speed)
        return np.asarray(missing / max(1.0, float(np.max(np.abs(missing) / speed))))


@dataclasses.dataclass(frozen=True)
class Approach(Phase):
    """Goes along an axis until it is somewhere, whatever it takes.

    Attributes:
        axis: number in `parts.AXES`.
        end: its coordinate there [m, rad].
        speed: of a step; negative for the way back.
        effort: resistance at which it ends before [N, N m].
        steps: at most.
    """

    axis: int
    end: float
    speed: float
    effort: float
    steps: int

    @property
    def most_steps(self) -> int:
        """See Phase."""
        return self.steps

    def act(self, observation: Array, step: int) -> Array | None:
        """See Phase."""
        sign = math.copysign(1.0, self.speed)
        is_there = sign * (observation[self.axis] - self.end) >= 0.0
        is_stopped = -sign * observation[6 + self.axis] >= self.effort
        if step >= self.steps or is_there or is_stopped:
            return None
        action = np.zeros(6)
        action[self.axis] = self.speed
        return action


@dataclasses.dataclass(frozen=True)
class TakeOut(Phase):
    """Takes the part out, by the classical baseline.

    Attributes:
        scenario: of the part.
        exploration: standard deviation of noise on the actions [m]; rotations get 0.1
            degrees per mm.
        seed: of the noise.
    """

    scenario: Scenario
    exploration: float = 0.0
    seed: int = 0

    @functools.cached_property
    def _policy(self) -> Policy:
        return make_policy("admittance", self.scenario)

    @property
    def most_steps(self) -> int:
        """See Phase."""
        return self.scenario.task.steps

    def act(self, observation: Array, step: int) -> Array | None:
        """See Phase."""
        last = self.scenario.part.stages[-1]
        margin = self.scenario.task.lift_success + PULL_AWAY
        if step >= self.most_steps or observation[last.axis] >= last.end + margin:
            return None
        action = np.asarray(self._policy(observation))
        noise = np.random.default_rng([self.seed, step]).normal(size=6)
        return action + self.exploration * AXIS_SHARES * noise


def way_back(pose: Array, speed: Array, away: float) -> Return:
    """Returns the way back to a pose.

    Args:
        pose: (6,).
        speed: (6,) largest action [m, rad].
        away: at most how many steps at full speed it is.
    """
    return Return(tuple(pose), tuple(speed), math.ceil(away) + _SLACK)
