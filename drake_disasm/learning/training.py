"""Reinforcement learning, online or from a dataset alone, one seed at a time.

All random numbers of episode e of seed s come from `SeedSequence([s, purpose, e])`, so
an episode depends on the checkpoint before it alone: a resumed training continues bit
for bit.
"""

import contextlib
import dataclasses
import enum
import functools
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import torch

from drake_disasm.common.errors import DisasmError
from drake_disasm.learning.agent import Agent
from drake_disasm.learning.checkpoint import (
    AGAIN,
    load_agent,
    load_checkpoint,
    save_checkpoint,
)
from drake_disasm.learning.environment import DisassemblyEnv
from drake_disasm.learning.hyperparameters import Hyperparameters
from drake_disasm.learning.replay import Replay
from drake_disasm.mdp import Outcome, action_bounds
from drake_disasm.policies import ActionMap, Network, make_policy
from drake_disasm.scenario import Scenario
from drake_disasm.task.episode import EpisodeSummary
from drake_disasm.task.recording import EpisodeRecorder

#: What a checkpoint's notes hold.
_NOTES = {
    "episodes": [dataclasses.asdict(EpisodeSummary(0)) | {"outcome": 0}],
    "rounds": 0,
    "seconds": {"simulation": 0.0, "updates": 0.0, "saving": 0.0},
}


class Recorded(Protocol):
    """The rows of an episode."""

    def columns(self) -> dict[str, np.ndarray]:
        """Returns the quantities of a log, each (T + 1,) or (T + 1, n)."""


class Purpose(enum.IntEnum):
    """What random numbers are used for."""

    PARAMETERS = 0
    EPISODE = 1
    EXPLORATION = 2
    UPDATES = 3
    VALIDATION = 4


def seed_for(seed: int, purpose: Purpose, number: int = 0) -> int:
    """Returns the seed of one purpose in one episode of a training."""
    sequence = np.random.SeedSequence([seed, int(purpose), number])
    return int(sequence.generate_state(1)[0])


@dataclasses.dataclass(frozen=True)
class TrainingSpec:
    """What defines a training; equal ones give the same bits on one machine.

    Attributes:
        scenario: the task.
        station: "twin" or "cell".
        config: hyper-parameters.
        seed: of everything.
        compiled: whether updates run compiled.
        threads: of torch; with more than one, the order of sums varies.
        envs: how many episodes run at a time, on a batch of twins; 1: on the diagram.
    """

    scenario: Scenario
    station: str
    config: Hyperparameters
    seed: int
    compiled: bool = True
    threads: int = 1
    envs: int = 1


class Training:
    """One agent that is trained on one environment.

    Attributes:
        agent: the learner.
        replay: its replay memory.
        summaries: of the episodes done.
        rounds: done on a dataset.
        scale: (12,) what the state is divided by before a network sees it.
        action_map: from the network's output to an action.
        seconds: spent in "simulation", "updates" and "saving", resumed runs included.

    Args:
        spec: of the training.
        demonstrations: transitions to mix into each batch, or None.
        dataset: transitions for offline training, or None.
    """

    def __init__(
        self,
        spec: TrainingSpec,
        demonstrations: Replay | None = None,
        dataset: Replay | None = None,
    ) -> None:
        torch.set_num_threads(spec.threads)
        self.spec, config = spec, spec.config
        if config.demonstrations and not (demonstrations and demonstrations.size):
            raise DisasmError(
                f"demonstrations: {config.demonstrations:g} of each batch are to come "
                "from logs; give some by `demonstrations`"
            )
        self.agent = Agent(
            config, seed_for(spec.seed, Purpose.PARAMETERS), spec.compiled
        )
        self.replay = dataset or Replay(config.replay)
        self._acts = dataset is None
        self.summaries: list[EpisodeSummary] = []
        self.rounds = 0
        self.seconds = {"simulation": 0.0, "updates": 0.0, "saving": 0.0}
        self.action_map = action_map(spec.scenario, config)
        self._demonstrations = demonstrations
        self.scale = np.array(config.observation_scale)
        self._observation = np.zeros(12)

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
        notes = load_checkpoint(path, self.agent, self._own_memory(), _NOTES)
        try:
            self.summaries = [_summary(row) for row in notes["episodes"]]
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
        with self.clock("saving"):
            save_checkpoint(path, self.agent, self._own_memory(), notes)

    def _own_memory(self) -> Replay:
        """Returns the memory that a checkpoint holds; a dataset is on disk already."""
        return self.replay if self._acts else Replay(1)

    @functools.cached_property
    def env(self) -> DisassemblyEnv:
        """The environment."""
        return DisassemblyEnv(self.spec.scenario, self.spec.station)

    def run_episodes(self) -> "Sequence[tuple[EpisodeSummary, Recorded]]":
        """Runs the next episodes, one here; see `run_episode`."""
        return [self.run_episode()]

    def run_episode(self) -> tuple[EpisodeSummary, EpisodeRecorder]:
        """Runs one episode, with updates by the schedule."""
        config, number = self.spec.config, len(self.summaries)
        learning = number >= config.warmup_episodes
        every_step = learning and config.schedule == "every_step"
        updates = self.generator(Purpose.UPDATES, number)
        explorer = self.explorer(number)
        summary, recorder = self._begin_episode(number)
        while summary.outcome is Outcome.RUNNING:
            self._step(explorer, summary, recorder)
            if every_step:
                self.learn(config.updates_per_step, updates)
                explorer.network = self.agent.network()
        if learning and not every_step:
            self.learn(config.updates_per_step * summary.steps, updates)
        if self.env.result.is_whole:
            summary.bolt_is_out = self.env.simulation.bolt_is_out()
        self.summaries.append(summary)
        return summary, recorder

    def _begin_episode(self, number: int) -> tuple[EpisodeSummary, EpisodeRecorder]:
        seed = seed_for(self.spec.seed, Purpose.EPISODE, number)
        with self.clock("simulation"):
            self._observation, _ = self.env.reset(seed=seed)
            recorder = EpisodeRecorder(self.env.simulation)
            recorder.measure()
        return EpisodeSummary(seed), recorder

    def _step(
        self, explorer: "Explorer", summary: EpisodeSummary, recorder: EpisodeRecorder
    ) -> None:
        """Takes one exploring step and stores its transition."""
        with self.clock("simulation"):
            before = self._observation
            scaled = (before / self.scale).astype(np.float32)
            chosen = self.agent.explore(
                explorer.network(scaled), explorer.sigma, explorer.generator
            )
            action = self.action_map.to_action(before, chosen)
            after, reward, terminated, _, _ = self.env.step(action)
            self.replay.add(scaled, chosen, reward, after / self.scale, terminated)
            self._observation = after
            result = self.env.result
            if not result.is_whole:
                summary.outcome = result.outcome
                return
            recorder.acted(result)
            summary.add(result)

    def run_round(self, updates: int) -> None:
        """Does updates on the replay memory, without acting (thesis 3.4.2)."""
        self.learn(updates, self.generator(Purpose.UPDATES, self.rounds))
        self.rounds += 1

    def learn(self, updates: int, generator: np.random.Generator) -> None:
        """Does some gradient updates on batches of the replay memory."""
        with self.clock("updates"):
            for _ in range(updates):
                self.agent.learn(self._batch(generator), generator)

    def _batch(self, generator: np.random.Generator) -> np.ndarray:
        config = self.spec.config
        shown = round(config.demonstrations * config.batch)
        rows = self.replay.sample(config.batch - shown, generator)
        if not shown or self._demonstrations is None:
            return rows
        return np.concatenate([rows, self._demonstrations.sample(shown, generator)])

    def explorer(self, number: int) -> "Explorer":
        """Returns how episode `number` explores.

        The hyper-parameter is in metres, for an agent with the task's whole range of
        actions; for rotations, and a residual's smaller range, it is scaled.
        """
        config, task = self.spec.config, self.spec.scenario.task
        sigma = config.exploration * config.exploration_decay**number
        generator = self.generator(Purpose.EXPLORATION, number)
        return Explorer(self.agent.network(), sigma / task.max_translation, generator)

    @contextlib.contextmanager
    def clock(self, name: str) -> Iterator[None]:
        """Adds the time that a block takes to `seconds` of a name."""
        began = time.perf_counter()
        yield
        self.seconds[name] += time.perf_counter() - began

    def generator(self, purpose: Purpose, number: int) -> np.random.Generator:
        """Returns the random numbers for a purpose in episode `number`."""
        return np.random.default_rng(seed_for(self.spec.seed, purpose, number))


#: What a residual's shares are of [m, rad]: how far a correction may go is a matter of
#: the contact and not of the task's bounds, and those of chapter 4 are what it was
#: chosen with.
_CORRECTION = np.array([0.003] * 3 + [np.deg2rad(1.0)] * 3)


@dataclasses.dataclass
class Explorer:
    """How an episode is explored: the actor, and the noise on its output."""

    network: Network
    sigma: float
    generator: np.random.Generator


def action_map(scenario: Scenario, config: Hyperparameters) -> ActionMap:
    """Returns the map from an agent's tanh output to an action of a task."""
    bounds, share = action_bounds(scenario.task), np.array(config.residual)
    if not config.base:
        return ActionMap(bounds * share)
    scale = np.minimum(bounds, _CORRECTION * share)
    return ActionMap(scale, make_policy(config.base, scenario))


def _summary(row: dict[str, Any]) -> EpisodeSummary:
    return EpisodeSummary(**(row | {"outcome": Outcome(row["outcome"])}))
