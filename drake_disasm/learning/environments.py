"""Environments that episodes run in, as rows that the training loop steps together."""

import dataclasses
from collections.abc import Sequence
from typing import Any, Protocol

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.wrappers.vector import RescaleAction

from drake_disasm.common.arrays import Array, namespace
from drake_disasm.common.errors import DisasmError
from drake_disasm.learning.environment import DisassemblyEnv
from drake_disasm.learning.training import TrainingSpec
from drake_disasm.mdp import Outcome
from drake_disasm.scenario import Scenario
from drake_disasm.task.recording import EpisodeRecorder
from drake_disasm.twin.batch import BatchedTwin, BatchResult, with_impact
from drake_disasm.twin.history import BatchHistory

Columns = dict[str, np.ndarray]


@dataclasses.dataclass(frozen=True)
class Step(BatchResult):
    """A step of n environments. Where it has failed it is not learned from.

    Attributes:
        seen: (n, s) what the agent sees after it.
        counts: (n,) whether it is a whole step of the episode.
    """

    seen: Array
    counts: Array

    @classmethod
    def joined(cls, steps: Sequence["Step"], order: np.ndarray) -> "Step":
        """Returns the steps of several environments as those of one.

        Args:
            steps: of the environments.
            order: (n,) which of their rows, one after another, each row is.
        """
        terms = {
            name: _in_order([step.reward_terms[name] for step in steps], order)
            for name in steps[0].reward_terms
        }
        failure = [why for step in steps for why in step.failure]
        others = ("observation", "place", "outcome", "has_failed", "seen", "counts")
        return cls(
            reward_terms=terms,
            failure=[failure[row] for row in order],
            **{
                name: _in_order([getattr(step, name) for step in steps], order)
                for name in others
            },
        )

    def rows(self, which: slice) -> "Step":
        """Returns the step of some environments."""
        parts = {f.name: getattr(self, f.name) for f in dataclasses.fields(self)}
        terms = {name: term[which] for name, term in parts.pop("reward_terms").items()}
        parts = {name: values[which] for name, values in parts.items()}
        return Step(reward_terms=terms, **parts)


class Environments(Protocol):
    """n environments, whose episodes the loop begins, steps and ends.

    Attributes:
        count: n.
    """

    count: int

    def begin(self, rows: np.ndarray, seeds: Sequence[int]) -> Array:
        """Begins episodes in some rows (m,); returns all observations (n, s)."""

    def step(self, actions: Array) -> Step:
        """Takes a step in all rows; where no episode runs it does not matter.

        Args:
            actions: (n, a) in the environments' units.
        """

    def bolt_is_out(self) -> Array:
        """Returns whether each bolt truly is out (n,)."""

    def recorded(self, row: int, steps: int) -> Columns | None:
        """Returns a row's newest episode as columns of a log, if it is recorded."""


class DiagramRow:
    """The diagram as one row; after an episode's end it stands still."""

    count = 1

    def __init__(self, scenario: Scenario, station: str) -> None:
        self._env = DisassemblyEnv(scenario, station)
        self._recorder: EpisodeRecorder
        self._last: Step | None = None

    def begin(self, rows: np.ndarray, seeds: Sequence[int]) -> np.ndarray:
        """Resets the diagram."""
        self._last = None
        observation, _ = self._env.reset(seed=seeds[0])
        self._recorder = EpisodeRecorder(self._env.simulation)
        self._recorder.measure()
        return observation[None]

    def step(self, actions: np.ndarray) -> Step:
        """Steps the diagram; what the arm can't do is learned from, as an end."""
        if self._last is not None and self._last.outcome[0] != Outcome.RUNNING:
            return self._last
        observation, *_ = self._env.step(actions[0])
        result = self._env.result
        if result.is_whole:
            self._recorder.acted(result)
        self._last = Step(
            result.observation[None],
            result.place[None],
            {name: np.array([term]) for name, term in result.reward_terms.items()},
            np.array([result.outcome]),
            np.array([False]),
            [""],
            seen=observation[None],
            counts=np.array([result.is_whole]),
        )
        return self._last

    def bolt_is_out(self) -> np.ndarray:
        """Asks the simulation."""
        return np.array([self._env.simulation.bolt_is_out()])

    def recorded(self, row: int, steps: int) -> Columns:
        """Returns what the recorder has."""
        return self._recorder.columns()


class TwinRows:
    """A batch of twins.

    Args:
        twin: the batch.
        is_recorded: whether episodes are recorded, which costs memory.
    """

    def __init__(self, twin: BatchedTwin, is_recorded: bool = True) -> None:
        self._twin, self.count = twin, twin.count
        self._is_recorded = is_recorded
        self._history: BatchHistory | None = None
        self._has_begun = False

    def begin(self, rows: np.ndarray, seeds: Sequence[int]) -> Array:
        """Settles the bolts of some rows."""
        twin = self._twin
        if self._has_begun and len(rows) < self.count:
            twin.start(rows, seeds, twin.begin(rows, seeds))
            if self._history:
                self._history.begin(rows)
            return twin.observation
        every = np.zeros(self.count, np.int64)
        every[rows] = seeds
        twin.reset(every.tolist())
        self._has_begun = True
        self._history = BatchHistory(twin) if self._is_recorded else None
        return twin.observation

    def step(self, actions: Array) -> Step:
        """Steps the batch."""
        result = self._twin.step(actions)
        if self._history:
            self._history.add(result)
        counts = result.has_failed | True
        return Step(**vars(result), seen=result.observation, counts=counts)

    def bolt_is_out(self) -> np.ndarray:
        """Asks the batch."""
        return self._twin.bolt_is_out()

    def recorded(self, row: int, steps: int) -> Columns | None:
        """Returns what the history has, if there is one."""
        return self._history.episode(row, steps) if self._history else None


class JoinedRows:
    """Environments of several tasks as those of one.

    Args:
        parts: of each task the rows (m,) that are its, in order, and its environments.
    """

    def __init__(self, parts: Sequence[tuple[np.ndarray, Environments]]) -> None:
        self._parts = list(parts)
        #: Which of the parts' rows, one after another, each row is.
        self._order = np.argsort(np.concatenate([rows for rows, _ in parts]))
        self.count = len(self._order)
        self._seen: list[Array] = [None] * len(self._parts)

    def begin(self, rows: np.ndarray, seeds: Sequence[int]) -> Array:
        """Begins episodes in tasks that have such rows; at first in all."""
        seed_of = dict(zip(rows.tolist(), seeds, strict=True))
        for number, (own, environments) in enumerate(self._parts):
            is_first = self._seen[number] is None
            new = np.flatnonzero(np.isin(own, rows) | is_first)
            if len(new):
                own_seeds = [seed_of.get(row, 0) for row in own[new].tolist()]
                self._seen[number] = environments.begin(new, own_seeds)
        return _in_order(self._seen, self._order)

    def step(self, actions: Array) -> Step:
        """Steps all tasks."""
        steps = [each.step(actions[rows]) for rows, each in self._parts]
        self._seen = [step.seen for step in steps]
        return Step.joined(steps, self._order)

    def bolt_is_out(self) -> Array:
        """Asks all tasks."""
        is_out = [each.bolt_is_out() for _, each in self._parts]
        return _in_order(is_out, self._order)

    def recorded(self, row: int, steps: int) -> Columns | None:
        """Asks the task whose row it is."""
        for rows, environments in self._parts:
            if row in rows:
                own = int(np.flatnonzero(rows == row)[0])
                return environments.recorded(own, steps)
        return None


def _in_order(parts: Sequence[Array], order: np.ndarray) -> Array:
    """Returns the rows of several arrays, one after another, in another order."""
    return namespace(parts[0]).concat(list(parts))[order]


class GymnasiumRows:
    """Somebody's vector environment of gymnasium, whose spaces are boxes.

    An agent's output in [-1, 1] becomes an action within the box. An environment that
    terminates has succeeded if `infos["is_success"]` says so; otherwise its outcome is
    WORKSPACE. Its reward is one term, "reward". All rows begin together.

    Attributes:
        sizes: how many numbers are observed and chosen.

    Args:
        envs: an episode that ends may be followed by another in the next step, but not
            in the same one (AutoresetMode.NEXT_STEP, gymnasium's usual).

    Raises:
        DisasmError: its spaces or its way to reset don't fit.
    """

    def __init__(self, envs: VectorEnv[Any, Any, Any]) -> None:
        if not isinstance(envs, VectorEnv):
            raise DisasmError(
                f"{type(envs).__name__}: is no vector environment; make it with "
                "gymnasium.make_vec"
            )
        self.sizes = (
            _size_of("observation_space", envs.single_observation_space),
            _size_of("action_space", envs.single_action_space),
        )
        mode = envs.metadata.get("autoreset_mode", AutoresetMode.NEXT_STEP)
        if mode is not AutoresetMode.NEXT_STEP:
            raise DisasmError(
                f"autoreset_mode: {mode} loses an episode's end; make the environment "
                "with AutoresetMode.NEXT_STEP"
            )
        one = np.ones(self.sizes[1], envs.single_action_space.dtype)
        self._envs = RescaleAction(envs, -one, one)
        self.count = envs.num_envs
        self._runs = np.zeros(self.count, bool)

    def begin(self, rows: np.ndarray, seeds: Sequence[int]) -> np.ndarray:
        """Resets all rows.

        Raises:
            DisasmError: an episode runs in one.
        """
        if self._runs.any():
            raise DisasmError(
                "trainings: all rows of a vector environment begin together; give each "
                "training an environment of its own"
            )
        self._runs[rows] = True
        every = np.zeros(self.count, np.int64)
        every[rows] = seeds
        seed: Any = every.tolist()  # which gymnasium's wrappers don't declare
        observation, _ = self._envs.reset(seed=seed)
        return np.array(observation, float)

    def step(self, actions: np.ndarray) -> Step:
        """Steps them."""
        actions = actions.astype(self._envs.single_action_space.dtype)
        observation, reward, terminated, truncated, infos = self._envs.step(actions)
        is_finite = np.isfinite(observation).all(axis=1) & np.isfinite(reward)
        if not is_finite[self._runs].all():
            raise DisasmError(
                "observation, reward: the vector environment gives some that are not "
                "finite; the agent can't learn from them"
            )
        self._runs &= ~(terminated | truncated)
        won = np.asarray(infos.get("is_success", np.zeros(self.count)), bool)
        ends = np.where(won, Outcome.SUCCESS, Outcome.WORKSPACE)
        cut = np.where(truncated, Outcome.STEP_LIMIT, Outcome.RUNNING)
        return Step(
            np.zeros((self.count, 12)),
            np.zeros((self.count, 3)),
            {"reward": np.array(reward, float)},
            np.where(terminated, ends, cut),
            np.zeros(self.count, bool),
            [""] * self.count,
            seen=np.array(observation, float),
            counts=np.ones(self.count, bool),
        )

    def bolt_is_out(self) -> np.ndarray:
        """Knows no bolt."""
        return np.zeros(self.count, bool)

    def recorded(self, row: int, steps: int) -> None:
        """Records nothing."""


def _size_of(name: str, space: gymnasium.Space[Any]) -> int:
    if not isinstance(space, gymnasium.spaces.Box) or len(space.shape) != 1:
        raise DisasmError(f"{name}: {space} is no Box of one axis; flatten it")
    if name == "action_space" and not space.is_bounded():
        raise DisasmError(f"{name}: {space} has no bounds; give some, or clip actions")
    return space.shape[0]


def make_environments(
    specs: Sequence[TrainingSpec], is_batch: bool = False, is_recorded: bool = True
) -> Environments:
    """Returns the environments of trainings on their tasks.

    Args:
        specs: one; or several, each of which gets one twin of a batch for each task.
        is_batch: whether one episode at a time runs on a batch, too.
        is_recorded: as of `TwinRows`.
    """
    first = specs[0]
    if not first.others:
        return _environments(specs, is_batch, is_recorded)
    count, tasks = first.envs, len(first.scenarios)
    rows = np.arange(len(specs) * tasks * count).reshape(len(specs), tasks, count)
    parts = []
    for task in range(tasks):
        own = [_of_task(spec, task) for spec in specs]
        environments = _environments(own, is_batch, is_recorded)
        parts.append((rows[:, task].ravel(), environments))
    return JoinedRows(parts)


def _of_task(spec: TrainingSpec, task: int) -> TrainingSpec:
    return dataclasses.replace(spec, scenario=spec.scenarios[task], others=())


def _environments(
    specs: Sequence[TrainingSpec], is_batch: bool, is_recorded: bool
) -> DiagramRow | TwinRows:
    """Returns the environments of trainings on one task each."""
    first = specs[0]
    if len(specs) == 1 and first.envs == 1 and not is_batch:
        return DiagramRow(first.scenario, first.station)
    shared = {id(s.scenario): with_impact(s.scenario) for s in specs}
    scenarios = [shared[id(s.scenario)] for s in specs for _ in range(s.envs)]
    same = scenarios[0] if len(shared) == 1 else scenarios
    return TwinRows(BatchedTwin(same, len(scenarios), first.device), is_recorded)
