"""Learning from many episodes at a time, on a batch of twins: one agent, or several."""

import contextlib
import copy
import dataclasses
import functools
import time
from collections.abc import Iterator, Sequence

import numpy as np

from drake_disasm.common.arrays import to_numpy
from drake_disasm.common.errors import DisasmError
from drake_disasm.learning.training import (
    Explorer,
    Purpose,
    Training,
    seed_for,
)
from drake_disasm.mdp import Outcome
from drake_disasm.policies import ActionMap
from drake_disasm.scenario import Scenario
from drake_disasm.task.episode import EpisodeSummary
from drake_disasm.task.simulation import StepResult
from drake_disasm.twin.batch import BatchedTwin, BatchResult, with_impact
from drake_disasm.twin.history import BatchHistory, RecordedEpisode


def refuse_envs(envs: int, station: str, acts: bool, lockstep: bool = False) -> None:
    """Refuses several episodes at a time where there is no batch.

    Args:
        envs: how many of one agent.
        station: on which the agent learns.
        acts: whether it acts at all.
        lockstep: whether agents are trained side by side.

    Raises:
        DisasmError: says what to give instead.
    """
    if lockstep and (envs > 1 or station != "twin" or not acts):
        raise DisasmError(
            "lockstep: agents side by side have one environment each, on a batch of "
            "twins; leave out `envs`, `station` and logs to learn from, or `lockstep`"
        )
    if envs > 1 and station != "twin":
        raise DisasmError(
            f"envs: station '{station}' has no batch; give `station` twin, or one of "
            "`envs`"
        )
    if envs > 1 and not acts:
        raise DisasmError(
            f"envs: {envs} episodes at a time, but learning from logs runs none; leave "
            "`envs` out"
        )


@dataclasses.dataclass
class _Running:
    """An episode that runs in one environment of the batch."""

    row: int
    summary: EpisodeSummary
    explorer: Explorer
    action_map: ActionMap
    is_running: bool = True


class _Learner:
    """A training's next episodes, in environments of a batch.

    Args:
        training: whose they are.
        rows: of the batch, as many as there are episodes.
    """

    def __init__(self, training: Training, rows: Sequence[int]) -> None:
        config, first = training.spec.config, len(training.summaries)
        self.training = training
        self._learns = first >= config.warmup_episodes
        self._every_step = config.schedule == "every_step"
        self._updates = training.generator(Purpose.UPDATES, first)
        self.episodes = [
            _Running(
                row,
                EpisodeSummary(seed_for(training.spec.seed, Purpose.EPISODE, number)),
                training.explorer(number),
                copy.deepcopy(training.action_map),
            )
            for number, row in enumerate(rows, first)
        ]

    @property
    def running(self) -> list[_Running]:
        """Episodes that have not ended."""
        return [episode for episode in self.episodes if episode.is_running]

    def act(self, before: np.ndarray, chosen: np.ndarray, actions: np.ndarray) -> None:
        """Chooses the actions of the episodes that run, exploring.

        Args:
            before: (n, 12) the newest observations of the batch.
            chosen, actions: (n, 6) in [-1, 1] and in m and rad; their rows are set.
        """
        training = self.training
        for episode in self.running:
            row, explorer = episode.row, episode.explorer
            scaled = (before[row] / training.scale).astype(np.float32)
            chosen[row] = training.agent.explore(
                explorer.network(scaled), explorer.sigma, explorer.generator
            )
            actions[row] = episode.action_map.to_action(before[row], chosen[row])

    def take(
        self,
        result: BatchResult,
        before: np.ndarray,
        chosen: np.ndarray,
        is_out: np.ndarray,
    ) -> None:
        """Takes a step of the episodes that run, and learns if each step teaches.

        Args:
            result: of the batch.
            before, chosen: as of `act`.
            is_out: (n,) whether each bolt truly is out.
        """
        running, training = self.running, self.training
        after = to_numpy(result.observation)
        for episode in running:
            row, step = episode.row, _result_of(result, episode.row)
            episode.summary.add(step)
            episode.summary.bolt_is_out = bool(is_out[row])
            episode.is_running = step.outcome is Outcome.RUNNING
            if result.failure[row]:
                episode.is_running = False
                continue
            training.replay.add(
                (before[row] / training.scale).astype(np.float32),
                chosen[row],
                step.reward,
                after[row] / training.scale,
                step.outcome.terminated,
            )
        if self._learns and self._every_step and running:
            config = training.spec.config
            training.learn(config.updates_per_step * len(running), self._updates)
            network = training.agent.network()
            for episode in running:
                episode.explorer.network = network

    def end(self) -> None:
        """Learns from what the episodes showed, if each step did not teach."""
        training, config = self.training, self.training.spec.config
        if self._learns and not self._every_step:
            steps = sum(episode.summary.steps for episode in self.episodes)
            training.learn(config.updates_per_step * steps, self._updates)
        training.summaries += [episode.summary for episode in self.episodes]


def _begun(twin: BatchedTwin, learners: Sequence[_Learner]) -> BatchHistory:
    """Begins the learners' episodes in a batch, all together; returns its history."""
    seeds = [0] * twin.count
    for learner in learners:
        for episode in learner.episodes:
            seeds[episode.row] = episode.summary.seed
    twin.reset(seeds)
    return BatchHistory(twin)


def _step(
    twin: BatchedTwin, history: BatchHistory, learners: Sequence[_Learner]
) -> None:
    """Takes one step in all episodes that run."""
    before = np.array(to_numpy(twin.observation))
    chosen, actions = np.zeros((2, twin.count, 6))
    with _shared_clock([learner.training for learner in learners]):
        for learner in learners:
            learner.act(before, chosen, actions)
        result = twin.step(actions)
        history.add(result)
    is_out = twin.bolt_is_out()
    for learner in learners:
        learner.take(result, before, chosen, is_out)


@contextlib.contextmanager
def _shared_clock(trainings: Sequence[Training]) -> Iterator[None]:
    """Has each training bear its share of the time of a simulation."""
    began = time.perf_counter()
    yield
    spent = time.perf_counter() - began
    for training in trainings:
        training.seconds["simulation"] += spent / len(trainings)


class LockstepTraining(Training):
    """A training whose episodes run in rounds, as many at a time as `spec.envs`.

    All episodes of a round begin together; one that ends waits for the others. Seeds,
    exploration and what is learned from are per episode as in `Training`; the agent
    that explores has learned from the rounds before, and with the schedule
    `every_step` from the steps of this one. Contact is IMPACT.
    """

    @functools.cached_property
    def _twin(self) -> BatchedTwin:
        return BatchedTwin(with_impact(self.spec.scenario), self.spec.envs, "numpy")

    def run_episodes(self) -> list[tuple[EpisodeSummary, RecordedEpisode]]:
        """Runs one round of episodes, with updates by the schedule."""
        count = min(self.spec.envs, self.spec.config.episodes - len(self.summaries))
        learner = _Learner(self, range(count))
        with self.clock("simulation"):
            history = _begun(self._twin, [learner])
        while learner.running:
            _step(self._twin, history, [learner])
        learner.end()
        return [
            (episode.summary, history.episode(episode.row, episode.summary.steps))
            for episode in learner.episodes
        ]


class LockstepTrainings:
    """Several trainings side by side, each on one environment of a batch of twins.

    What each learns from is its own: an agent, episodes one after the other, updates
    after each of them. Only the simulation is shared; none waits for another's
    episode to end.

    Args:
        trainings: on the twin; their scenarios and hyper-parameters may differ. Their
            `envs` is 1.
    """

    def __init__(self, trainings: Sequence[Training]) -> None:
        self.trainings = list(trainings)
        scenarios: dict[int, Scenario] = {}
        for training in self.trainings:
            own = training.spec.scenario
            scenarios.setdefault(id(own), with_impact(own))
        rows = [scenarios[id(t.spec.scenario)] for t in self.trainings]
        self._twin = BatchedTwin(rows, device="numpy")
        self._learners: dict[int, _Learner] = {}
        self._history: BatchHistory | None = None

    @property
    def unfinished(self) -> list[int]:
        """Numbers of the trainings that have episodes to run."""
        return [
            number
            for number, training in enumerate(self.trainings)
            if len(training.summaries) < training.spec.config.episodes
        ]

    def run_episodes(self) -> dict[int, RecordedEpisode]:
        """Goes on until an episode ends; returns those that did, by training.

        Their trainings have learned from them.
        """
        history = self._begin()
        while all(learner.running for learner in self._learners.values()):
            _step(self._twin, history, list(self._learners.values()))
        ended = {}
        for number, learner in list(self._learners.items()):
            if not learner.running:
                learner.end()
                [episode] = learner.episodes
                ended[number] = history.episode(number, episode.summary.steps)
                del self._learners[number]
        return ended

    def _begin(self) -> BatchHistory:
        """Begins the next episode of each training that has none running."""
        new = [number for number in self.unfinished if number not in self._learners]
        learners = {i: _Learner(self.trainings[i], [i]) for i in new}
        with _shared_clock([learner.training for learner in learners.values()]):
            if self._history is None:
                self._history = _begun(self._twin, list(learners.values()))
            elif new:
                rows = np.array(new)
                seeds = [x.episodes[0].summary.seed for x in learners.values()]
                self._twin.start(rows, seeds, self._twin.begin(rows, seeds))
                self._history.begin(rows)
        self._learners |= learners
        return self._history


def _result_of(result: BatchResult, row: int) -> StepResult:
    """Returns what a step returned of one environment."""
    terms = {n: float(to_numpy(t)[row]) for n, t in result.reward_terms.items()}
    outcome = Outcome(int(to_numpy(result.outcome)[row]))
    found, place = (
        np.array(to_numpy(each)[row]) for each in (result.observation, result.place)
    )
    return StepResult(found, place, terms, outcome)
