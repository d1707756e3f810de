"""One agent in training: what it remembers, has done, and draws at random.

All random numbers of episode e of seed s come from `SeedSequence([s, purpose, e])`, so
an episode depends on the checkpoint before it alone: a resumed training continues bit
for bit.
"""

import contextlib
import dataclasses
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import torch

from drake_disasm.common.arrays import Array, namespace
from drake_disasm.common.errors import DisasmError
from drake_disasm.learning.actor_critic import ActorCritic
from drake_disasm.learning.agent import Agent
from drake_disasm.learning.checkpoint import (
    AGAIN,
    load_agent,
    load_checkpoint,
    save_checkpoint,
)
from drake_disasm.learning.hyperparameters import Hyperparameters
from drake_disasm.learning.random_numbers import (
    Purpose,
    Random,
    TensorRandom,
    seed_for,
)
from drake_disasm.learning.replay import ACTIONS, STATES, Replay
from drake_disasm.mdp import Outcome, action_bounds
from drake_disasm.policies import StageAxes, TaskView, TaskViews, make_policy
from drake_disasm.scenario import Scenario
from drake_disasm.task.episode import EpisodeSummary

#: What a checkpoint's notes hold.
_NOTES = {
    "episodes": [dataclasses.asdict(EpisodeSummary(0)) | {"outcome": 0}],
    "rounds": 0,
    "seconds": {"simulation": 0.0, "updates": 0.0, "saving": 0.0},
}
#: What a residual's shares are of [m, rad]: how far a correction may go is a matter of
#: the contact and not of the task's bounds, and those of chapter 4 are what it was
#: chosen with.
_CORRECTION = np.array([0.003] * 3 + [np.deg2rad(1.0)] * 3)


@dataclasses.dataclass(frozen=True)
class TrainingSpec:
    """What defines a training on the task; equal ones give equal bits on one machine.

    Attributes:
        scenario: the task.
        station: "twin" or "cell".
        config: hyper-parameters.
        seed: of everything.
        compiled: whether updates run compiled.
        threads: of torch; with more than one, the order of sums varies.
        envs: how many episodes of each task run at a time, on a batch of twins; 1: on
            the diagram.
        others: further tasks, whose episodes run with the first one's.
        device: "numpy", or where tensors stay from the step to the update.
    """

    scenario: Scenario
    station: str
    config: Hyperparameters
    seed: int
    compiled: bool = True
    threads: int = 1
    envs: int = 1
    device: str = "numpy"
    others: tuple[Scenario, ...] = ()

    @property
    def scenarios(self) -> tuple[Scenario, ...]:
        """The tasks."""
        return self.scenario, *self.others


class Training:
    """One agent in training, on whatever environments the loop has.

    Attributes:
        agent: the learner.
        config: its schedule: episodes, updates, batch, exploration.
        seed: of everything that is drawn.
        device: "numpy", or where its tensors are.
        replay: its replay memory.
        summaries: of the episodes done.
        rounds: done on a dataset.
        view: what the agent sees of each row, and what its choices do there.
        seconds: spent in "simulation", "updates" and "saving", resumed runs included.

    Args:
        agent, config, seed, device: see above.
        view: None: the agent sees the state, and its output is the action.
        exploration_unit: what `config.exploration` is divided by.
        demonstrations: transitions to mix into each batch, or None.
        dataset: transitions to learn from without acting, or None.
        updates: on the dataset, in as many rounds as there would be episodes.
        sizes: how many numbers the agent observes and chooses.
    """

    def __init__(
        self,
        agent: Agent,
        config: Hyperparameters,
        seed: int,
        device: str = "numpy",
        *,
        view: TaskView | TaskViews | None = None,
        exploration_unit: float = 1.0,
        demonstrations: Replay | None = None,
        dataset: Replay | None = None,
        updates: int = 0,
        sizes: tuple[int, int] = (STATES, ACTIONS),
    ) -> None:
        if config.demonstrations and not (demonstrations and demonstrations.size):
            raise DisasmError(
                f"demonstrations: {config.demonstrations:g} of each batch are to come "
                "from logs; give some by `demonstrations`"
            )
        self.agent, self.config, self.seed, self.device = agent, config, seed, device
        self.replay = dataset or Replay(config.replay, *sizes, device)
        view = view or TaskView(np.ones(sizes[0]), np.ones(sizes[1]))
        if isinstance(view, TaskView):
            _refuse_other_sizes(view, sizes)
        self.view = view.placed(self.placed)
        self.summaries: list[EpisodeSummary] = []
        self.rounds = 0
        self.seconds = {"simulation": 0.0, "updates": 0.0, "saving": 0.0}
        self._acts, self._updates, self._actions = dataset is None, updates, sizes[1]
        self._demonstrations, self._unit = demonstrations, exploration_unit

    @property
    def done(self) -> int:
        """Episodes, or rounds on a dataset."""
        return len(self.summaries) if self._acts else self.rounds

    @property
    def is_finished(self) -> bool:
        """Whether all of them are done."""
        return self.done >= self.config.episodes

    def start_from(self, path: Path) -> None:
        """Starts from another training's agent, with an empty replay memory.

        Its transitions are not taken over: they are of another station or scenario.

        Raises:
            DisasmError: the checkpoint is damaged or of another agent.
        """
        load_agent(path, self.agent)

    def restore(self, path: Path) -> None:
        """Restores a checkpoint.

        Raises:
            DisasmError: it is damaged or of another agent.
        """
        notes = load_checkpoint(path, self.agent, self._stored_memory(), _NOTES)
        try:
            self.summaries = [
                EpisodeSummary(**(row | {"outcome": Outcome(row["outcome"])}))
                for row in notes["episodes"]
            ]
        except (ValueError, TypeError) as error:
            raise DisasmError(f"{path}: has odd notes ({error}); {AGAIN}") from None
        self.rounds, self.seconds = notes["rounds"], notes["seconds"]

    def save(self, path: Path) -> None:
        """Writes a checkpoint, from which training continues bit for bit."""
        notes = {
            "episodes": [dataclasses.asdict(s) for s in self.summaries],
            "rounds": self.rounds,
            "seconds": self.seconds,
        }
        with clock([self], "saving"):
            save_checkpoint(path, self.agent, self._stored_memory(), notes)

    def _stored_memory(self) -> Replay:
        """Returns the memory that a checkpoint holds; a dataset is on disk already."""
        return self.replay if self._acts else Replay(1)

    def learn_round(self) -> None:
        """Does a round of the updates on the dataset (thesis 3.4.2)."""
        parts, first = self.config.episodes, self.rounds
        done, following = (self._updates * i // parts for i in (first, first + 1))
        self.learn(following - done, self.generator(Purpose.UPDATES, first))
        self.rounds += 1

    def learn(self, updates: int, generator: Random) -> None:
        """Does some gradient updates on batches of the replay memory."""
        with clock([self], "updates"):
            for _ in range(updates):
                self.agent.learn(self._batch(generator), generator)

    def _batch(self, generator: Random) -> Array:
        config = self.config
        shown = round(config.demonstrations * config.batch)
        rows = self.replay.sample(config.batch - shown, generator)
        if not shown or self._demonstrations is None:
            return rows
        further = self._demonstrations.sample(shown, generator)
        return namespace(rows).concat([rows, further])

    def sigma(self, number: int) -> float:
        """Returns the exploration noise on the agent's output in episode `number`.

        The hyper-parameter is in metres, for an agent with the task's whole range of
        actions; for rotations, and a residual's smaller range, it is scaled.
        """
        sigma = self.config.exploration * self.config.exploration_decay**number
        return sigma / self._unit

    def noise(self, first: int, count: int) -> Callable[[], Array]:
        """Returns what draws a step's noise (count, a) for episodes from `first` on."""
        if self.device == "numpy":
            numbers = range(first, first + count)
            one_by_one = [self.generator(Purpose.EXPLORATION, n) for n in numbers]
            return lambda: np.stack(
                [g.standard_normal(self._actions, np.float32) for g in one_by_one]
            )
        generator = self.generator(Purpose.EXPLORATION, first)
        return lambda: generator.standard_normal((count, self._actions), np.float32)

    def placed(self, array: np.ndarray) -> Array:
        """Returns an array, as a tensor in a training on a device."""
        if self.device == "numpy":
            return array
        return torch.as_tensor(array, device=self.device)

    def generator(self, purpose: Purpose, number: int) -> Random:
        """Returns the random numbers for a purpose in episode `number`."""
        seed = seed_for(self.seed, purpose, number)
        if self.device == "numpy":
            return np.random.default_rng(seed)
        return TensorRandom(seed, self.device)


def _refuse_other_sizes(view: TaskView, sizes: tuple[int, int]) -> None:
    found = np.size(view.observation_scale), np.size(view.action_scale)
    if found != sizes:
        raise DisasmError(
            f"view: has scales of {found[0]} and {found[1]} numbers, not of "
            f"{sizes[0]} and {sizes[1]}"
        )


def make_training(
    spec: TrainingSpec,
    demonstrations: Replay | None = None,
    dataset: Replay | None = None,
    updates: int = 0,
) -> Training:
    """Returns a training on its tasks, at its beginning; see `Training`."""
    torch.set_num_threads(spec.threads)
    views = [task_view(scenario, spec.config) for scenario in spec.scenarios]
    seed = seed_for(spec.seed, Purpose.PARAMETERS)
    return Training(
        ActorCritic(spec.config, seed, spec.compiled, device=spec.device),
        spec.config,
        spec.seed,
        spec.device,
        view=TaskViews(views, spec.envs) if spec.others else views[0],
        exploration_unit=spec.scenario.task.max_translation,
        demonstrations=demonstrations,
        dataset=dataset,
        updates=updates,
    )


@contextlib.contextmanager
def clock(trainings: list[Training], name: str) -> Iterator[None]:
    """Adds the time that a block takes to trainings' `seconds`, in equal shares."""
    began = time.perf_counter()
    yield
    spent = time.perf_counter() - began
    for training in trainings:
        training.seconds[name] += spent / len(trainings)


def task_view(scenario: Scenario, config: Hyperparameters) -> TaskView:
    """Returns what an agent sees of a task, and what its tanh output does there."""
    bounds, share = action_bounds(scenario.task), np.array(config.residual)
    seen, base = np.array(config.observation_scale), None
    axes = StageAxes.of(scenario) if config.axes == "stage" else None
    if config.base:
        bounds = np.minimum(bounds, _CORRECTION * share)
        base = make_policy(config.base, scenario)
    else:
        bounds = bounds * share
    return TaskView(seen, bounds, base, axes)
