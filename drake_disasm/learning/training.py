"""Learning by trial and error, or from a dataset alone, one seed at a time.

Everything that is drawn at random in episode e of seed s comes from
`SeedSequence([s, purpose, e])`, so an episode depends on the checkpoint before it and
on nothing else: a resumed training goes on bit for bit.
"""

import dataclasses
import enum
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import torch

from drake_disasm.errors import DisasmError
from drake_disasm.learning.agent import Agent
from drake_disasm.learning.checkpoint import load_checkpoint, save_checkpoint
from drake_disasm.learning.environment import DisassemblyEnv
from drake_disasm.learning.hyperparameters import Hyperparameters
from drake_disasm.learning.replay import Replay
from drake_disasm.mdp import Outcome, action_bounds
from drake_disasm.policies import ActionMap, Network, make_policy
from drake_disasm.scenario import Scenario
from drake_disasm.task.episode import EpisodeRecorder, EpisodeSummary


class Purpose(enum.IntEnum):
    """What random numbers are for."""

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
    """What a training is; two of the same give the same bits on one machine.

    Attributes:
        scenario: the task.
        model: "twin" or "cell".
        config: hyper-parameters.
        seed: of everything.
        compiled: whether updates run compiled.
        threads: of torch; with more than one, sums come in another order.
    """

    scenario: Scenario
    model: str
    config: Hyperparameters
    seed: int
    compiled: bool = True
    threads: int = 1


#: Called after each episode with its number, its summary and its rows.
OnEpisode = Callable[[int, EpisodeSummary, EpisodeRecorder], None]


class Training:
    """One agent that learns on one environment.

    Attributes:
        agent: the learner.
        replay: its memory.
        summaries: of the episodes done.
        rounds: done on a dataset.
        seconds: spent in "simulation", "updates" and "saving", over all resumptions.

    Args:
        spec: what to do.
        demonstrations: transitions to mix into each batch, or None.
        dataset: transitions to learn from without acting, or None.
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
                "from logs; name some by --demonstrations DIR"
            )
        self.env = DisassemblyEnv(spec.scenario, spec.model)
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
        self._scale = np.array(config.observation_scale)

    def restore(self, path: Path) -> None:
        """Goes on from a checkpoint.

        Raises:
            DisasmError: it is damaged or of another agent.
        """
        notes = load_checkpoint(path, self.agent, self._own_memory())
        self.summaries = [_summary(row) for row in notes["episodes"]]
        self.rounds, self.seconds = notes["rounds"], notes["seconds"]

    def save(self, path: Path) -> None:
        """Writes a checkpoint from which `restore` goes on bit for bit."""
        began = time.perf_counter()
        notes = {
            "episodes": [dataclasses.asdict(s) for s in self.summaries],
            "rounds": self.rounds,
            "seconds": self.seconds,
        }
        save_checkpoint(path, self.agent, self._own_memory(), notes)
        self.seconds["saving"] += time.perf_counter() - began

    def _own_memory(self) -> Replay:
        """Returns what a checkpoint is to hold; a dataset is on disk already."""
        return self.replay if self._acts else Replay(1)

    def run_episode(self) -> tuple[EpisodeSummary, EpisodeRecorder]:
        """Plays one episode, and learns as the schedule says."""
        number = len(self.summaries)
        began, before = time.perf_counter(), self.seconds["updates"]
        explore = self._generator(Purpose.EXPLORATION, number)
        updates = self._generator(Purpose.UPDATES, number)
        sigma = self._sigma(number)
        per_step = self.spec.config.updates_per_step
        learning = number >= self.spec.config.warmup_episodes
        every_step = learning and self.spec.config.schedule == "every_step"
        network = self.agent.network()
        seed = seed_for(self.spec.seed, Purpose.EPISODE, number)
        summary = EpisodeSummary(seed)
        observation, _ = self.env.reset(seed=seed)
        recorder = EpisodeRecorder(self.env.simulation)
        recorder.measure()
        while summary.outcome is Outcome.RUNNING:
            observation = self._step(observation, network, sigma, explore)
            recorder.acted(self.env.result)
            summary.add(self.env.result)
            if every_step:
                self._learn(per_step, updates)
                network = self.agent.network()
        if learning and not every_step:
            self._learn(summary.steps * per_step, updates)
        summary.bolt_is_out = self.env.simulation.bolt_is_out()
        self.summaries.append(summary)
        spent = self.seconds["updates"] - before
        self.seconds["simulation"] += time.perf_counter() - began - spent
        return summary, recorder

    def run_round(self, updates: int) -> None:
        """Does updates on what the memory holds, without acting (thesis 3.4.2)."""
        self._learn(updates, self._generator(Purpose.UPDATES, self.rounds))
        self.rounds += 1

    def _step(
        self,
        observation: np.ndarray,
        network: Network,
        sigma: float,
        generator: np.random.Generator,
    ) -> np.ndarray:
        """Takes one exploring step, remembers it, and returns what is seen next."""
        scaled = (observation / self._scale).astype(np.float32)
        chosen = self.agent.explore(network(scaled), sigma, generator)
        action = self.action_map.to_action(observation, chosen)
        following, reward, terminated, _, _ = self.env.step(action)
        self.replay.add(scaled, chosen, reward, following / self._scale, terminated)
        return following

    def _learn(self, updates: int, generator: np.random.Generator) -> None:
        began = time.perf_counter()
        for _ in range(updates):
            self.agent.learn(self._batch(generator), generator)
        self.seconds["updates"] += time.perf_counter() - began

    def _batch(self, generator: np.random.Generator) -> np.ndarray:
        config = self.spec.config
        shown = round(config.demonstrations * config.batch)
        rows = self.replay.sample(config.batch - shown, generator)
        if not shown or self._demonstrations is None:
            return rows
        return np.concatenate([rows, self._demonstrations.sample(shown, generator)])

    def _sigma(self, number: int) -> float:
        """Returns the exploration noise on the choice in [-1, 1].

        The hyper-parameter is in metres of an agent that has the task's whole range;
        rotations, and a residual's smaller range, go in proportion.
        """
        config, task = self.spec.config, self.spec.scenario.task
        now = config.exploration * config.exploration_decay**number
        return now / task.max_translation

    def _generator(self, purpose: Purpose, number: int) -> np.random.Generator:
        return np.random.default_rng(seed_for(self.spec.seed, purpose, number))


def action_map(scenario: Scenario, config: Hyperparameters) -> ActionMap:
    """Returns how an agent's tanh output becomes an action on a task."""
    scale = action_bounds(scenario.task) * np.array(config.residual)
    return ActionMap(scale, make_policy(config.base) if config.base else None)


def _summary(row: dict[str, Any]) -> EpisodeSummary:
    return EpisodeSummary(**(row | {"outcome": Outcome(row["outcome"])}))
