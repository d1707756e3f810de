"""One agent that learns from many episodes at a time, on a batch of twins."""

import copy
import dataclasses

import numpy as np

from drake_disasm.batch.history import BatchHistory, RecordedEpisode
from drake_disasm.batch.twin import BatchedTwin, BatchResult, with_impact
from drake_disasm.common.arrays import to_numpy
from drake_disasm.common.errors import DisasmError
from drake_disasm.learning.replay import Replay
from drake_disasm.learning.training import (
    Explorer,
    Purpose,
    Training,
    TrainingSpec,
    seed_for,
)
from drake_disasm.mdp import Outcome
from drake_disasm.policies import ActionMap, Network
from drake_disasm.task.episode import EpisodeSummary
from drake_disasm.task.simulation import StepResult


def refuse_envs(envs: int, station: str, acts: bool) -> None:
    """Refuses several episodes at a time where there is no batch.

    Args:
        envs: how many.
        station: on which the agent learns.
        acts: whether it acts at all.

    Raises:
        DisasmError: says what to give instead.
    """
    if envs > 1 and station != "twin":
        raise DisasmError(
            f"envs: station '{station}' has no batch; use --station twin, or --envs 1"
        )
    if envs > 1 and not acts:
        raise DisasmError(
            f"envs: {envs} episodes at a time, but learning from logs runs none; leave "
            "--envs out"
        )


@dataclasses.dataclass
class _Running:
    """An episode that runs in one environment of the batch."""

    row: int
    summary: EpisodeSummary
    explorer: Explorer
    action_map: ActionMap
    is_running: bool = True


class LockstepTraining(Training):
    """A training whose episodes run in rounds, as many at a time as `spec.envs`.

    All episodes of a round begin together; one that ends waits for the others. Seeds,
    exploration and what is learned from are per episode as in `Training`; the agent
    that explores has learned from the rounds before, and with the schedule
    `every_step` from the steps of this one. Contact is IMPACT.

    Args:
        spec, demonstrations, dataset: as of Training.
    """

    def __init__(
        self,
        spec: TrainingSpec,
        demonstrations: Replay | None = None,
        dataset: Replay | None = None,
    ) -> None:
        super().__init__(spec, demonstrations, dataset)
        self._twin = BatchedTwin(with_impact(spec.scenario), spec.envs, "numpy")

    def run_episodes(self) -> list[tuple[EpisodeSummary, RecordedEpisode]]:
        """Runs one round of episodes, with updates by the schedule."""
        config, first = self.spec.config, len(self.summaries)
        learning = first >= config.warmup_episodes
        every_step = learning and config.schedule == "every_step"
        updates = self._generator(Purpose.UPDATES, first)
        with self._clock("simulation"):
            episodes, history = self._begin_round(first)
        network = self.agent.network()
        while any(episode.is_running for episode in episodes):
            with self._clock("simulation"):
                taken = self._step_all(network, episodes, history)
            if every_step:
                self._learn(config.updates_per_step * taken, updates)
                network = self.agent.network()
        if learning and not every_step:
            steps = sum(episode.summary.steps for episode in episodes)
            self._learn(config.updates_per_step * steps, updates)
        self.summaries += [episode.summary for episode in episodes]
        return [(e.summary, history.episode(e.row, e.summary.steps)) for e in episodes]

    def _begin_round(self, first: int) -> tuple[list[_Running], BatchHistory]:
        count = min(self.spec.envs, self.spec.config.episodes - first)
        seeds = [
            seed_for(self.spec.seed, Purpose.EPISODE, first + i)
            for i in range(self._twin.count)
        ]
        self._twin.reset(seeds)
        episodes = [
            _Running(
                row,
                EpisodeSummary(seeds[row]),
                self._explorer(first + row),
                copy.deepcopy(self.action_map),
            )
            for row in range(count)
        ]
        return episodes, BatchHistory(self._twin)

    def _step_all(
        self, network: Network, episodes: list[_Running], history: BatchHistory
    ) -> int:
        """Takes one exploring step in all episodes that run; returns how many."""
        before = np.array(to_numpy(self._twin.observation))
        scaled = (before / self._scale).astype(np.float32)
        outputs = network.rows(scaled)
        running = [episode for episode in episodes if episode.is_running]
        chosen, actions = np.zeros((2, len(before), 6))
        for episode in running:
            row, explorer = episode.row, episode.explorer
            chosen[row] = self.agent.explore(
                outputs[row], explorer.sigma, explorer.generator
            )
            actions[row] = episode.action_map.to_action(before[row], chosen[row])
        result = self._twin.step(actions)
        history.add(result)
        after = to_numpy(result.observation)
        is_out = self._twin.bolt_is_out()
        for episode in running:
            row, step = episode.row, _result_of(result, episode.row)
            episode.summary.add(step)
            episode.summary.bolt_is_out = bool(is_out[row])
            episode.is_running = step.outcome is Outcome.RUNNING
            if result.failure[row]:
                episode.is_running = False
                continue
            self.replay.add(
                scaled[row],
                chosen[row],
                step.reward,
                after[row] / self._scale,
                step.outcome.terminated,
            )
        return len(running)


def _result_of(result: BatchResult, row: int) -> StepResult:
    """Returns what a step returned of one environment."""
    terms = {n: float(to_numpy(t)[row]) for n, t in result.reward_terms.items()}
    outcome = Outcome(int(to_numpy(result.outcome)[row]))
    return StepResult(np.array(to_numpy(result.observation)[row]), terms, outcome)
