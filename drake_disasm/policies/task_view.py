"""What an agent sees of a task, and what its choices do there."""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Self

import numpy as np

from drake_disasm.common.arrays import Array, array_like, namespace
from drake_disasm.parts import AXES
from drake_disasm.policies.scripted import Admittance, Straight
from drake_disasm.scenario import Scenario


@dataclasses.dataclass(frozen=True)
class StageAxes:
    """The axes of the stage that the bolt is in, instead of those of the groove.

    The first is the axis along or about which the bolt is to move now; the others
    follow in cyclic order. Of the position or rotation along it an agent sees what is
    left of the stage. So it can leave parts that it has not seen.

    Attributes:
        way: the bolt's coordinates (`AXES`) along and about which it leaves.
        ends: of each stage [m, rad].
        switch: of the first stage's coordinate; beyond it the second stage is on
            [m, rad].
    """

    way: str
    ends: tuple[float, ...]
    switch: float

    @classmethod
    def of(cls, scenario: Scenario) -> Self:
        """Returns those of a scenario's part."""
        part = scenario.part
        switch = scenario.task.travel_success / part.stages[0].radius
        return cls(part.way, tuple(stage.end for stage in part.stages), switch)

    def observe(self, state: Array) -> Array:
        """Returns states (..., 12) in these axes, with what is left of the stage."""
        seen = [self._left(state, axis, end) for axis, end in self._stages]
        return self._of_stage(state, seen)

    def to_groove(self, state: Array, action: Array) -> Array:
        """Returns actions (..., 6) in these axes as actions in the groove's."""
        return self._of_stage(
            state, [_rolled(action, axis) for axis, _ in self._stages]
        )

    def from_groove(self, state: Array, action: Array) -> Array:
        """Returns actions (..., 6) in the groove's axes as actions in these."""
        return self._of_stage(
            state, [_rolled(action, -axis) for axis, _ in self._stages]
        )

    @property
    def _stages(self) -> list[tuple[int, float]]:
        """Axis and end of each stage."""
        return list(zip(map(AXES.index, self.way), self.ends, strict=True))

    @staticmethod
    def _left(state: Array, axis: int, end: float) -> Array:
        seen = _rolled(state, -axis)
        first = 3 * (axis // 3)  # of the rotations, or of the positions
        seen[..., first] = end - seen[..., first]
        return seen

    def _of_stage(self, state: Array, values: Sequence[Array]) -> Array:
        """Returns those of the values, one for each stage, of the stage that is on."""
        if len(values) == 1:
            return values[0]
        is_last = state[..., AXES.index(self.way[0])] > self.switch
        return namespace(state).where(is_last[..., None], values[1], values[0])


def _rolled(values: Array, axis: int) -> Array:
    """Returns triples (..., 3 n) whose coordinates are rolled by an axis's number."""
    xp, shape = namespace(values), values.shape
    triples = xp.reshape(values, (*shape[:-1], shape[-1] // 3, 3))
    return xp.reshape(xp.roll(triples, axis % 3, axis=-1), shape)


@dataclasses.dataclass(frozen=True, eq=False)
class TaskView:
    """Maps a task's observations to an agent's, and an agent's choices to actions.

    action = action_scale * chosen, plus the base policy's action where there is one:
    then the agent only corrects a policy that works, by at most `action_scale`
    (bounded residual; Johannink et al., 2019). Whoever asks the policy clips to the
    task's bounds (`systems.policy.ask`).

    Attributes:
        observation_scale: (s,) what the state is divided by; for a task of this
            package (12,) [m, rad, N, N m].
        action_scale: (a,) largest action or correction, (6,) [m, rad]; 0 leaves an
            axis to the base policy.
        base: policy that is corrected, or None.
        axes: in which the agent sees and acts; None: those of the groove.
    """

    observation_scale: Array
    action_scale: Array
    base: Straight | Admittance | None = None
    axes: StageAxes | None = None

    def placed(self, place: Callable[[np.ndarray], Array]) -> Self:
        """Returns the view with its scales where tensors are, once for all steps."""
        scales = place(self.observation_scale), place(self.action_scale)
        return dataclasses.replace(
            self, observation_scale=scales[0], action_scale=scales[1]
        )

    def observe(self, observation: Array) -> Array:
        """Returns what the agent sees (..., s) of states (..., s) in SI units."""
        seen = observation if self.axes is None else self.axes.observe(observation)
        return seen / _like(self.observation_scale, observation)

    def to_action(self, observation: Array, chosen: Array) -> Array:
        """Returns the actions (..., 6) [m, rad] of choices (..., 6) in [-1, 1].

        Args:
            observation: (..., 12) the states, in SI units.
            chosen: in [-1, 1].
        """
        action = _like(self.action_scale, observation) * chosen
        if self.axes is not None:
            action = self.axes.to_groove(observation, action)
        return action if self.base is None else action + self.base(observation)

    def from_action(self, observation: np.ndarray, action: np.ndarray) -> np.ndarray:
        """Returns the choices (..., 6) float32 that come nearest to actions.

        Args:
            observation: (..., 12) the states, in SI units.
            action: (..., 6) [m, rad].
        """
        if self.base is not None:
            action = action - self.base(observation)
        if self.axes is not None:
            action = self.axes.from_groove(observation, action)
        free = self.action_scale > 0.0
        chosen = np.divide(
            action, self.action_scale, out=np.zeros(action.shape), where=free
        )
        return np.clip(chosen, -1.0, 1.0).astype(np.float32)


class TaskViews:
    """The views of several tasks, each of which has as many rows, one after another.

    Args:
        views: of the tasks.
        rows: of each.
    """

    def __init__(self, views: Sequence[TaskView], rows: int) -> None:
        self._views, self._rows = list(views), rows

    def placed(self, place: Callable[[np.ndarray], Array]) -> "TaskViews":
        """Returns the same of views that are placed; see `TaskView`."""
        return TaskViews([view.placed(place) for view in self._views], self._rows)

    def observe(self, observation: Array) -> Array:
        """Returns what the agent sees (n, s) of states (n, s); see `TaskView`."""
        return self._joined(
            lambda view, rows: view.observe(observation[rows]), observation
        )

    def to_action(self, observation: Array, chosen: Array) -> Array:
        """Returns the actions (n, 6) of choices (n, 6); see `TaskView`."""
        return self._joined(
            lambda view, rows: view.to_action(observation[rows], chosen[rows]),
            observation,
        )

    def _joined(
        self, function: Callable[[TaskView, slice], Array], observation: Array
    ) -> Array:
        """Returns the rows that a function of view and rows gives."""
        count, size = len(observation), self._rows
        slices = [slice(first, first + size) for first in range(0, count, size)]
        return namespace(observation).concat(
            [function(v, rows) for v, rows in zip(self._views, slices, strict=False)]
        )


def _like(values: Array, array: Array) -> Array:
    return values if isinstance(array, np.ndarray) else array_like(values, array)
