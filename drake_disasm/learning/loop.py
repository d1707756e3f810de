"""The training loop: agents act in rows of environments, remember, and learn."""

from collections.abc import Sequence

import numpy as np

from drake_disasm.common.arrays import Array, array_like, namespace
from drake_disasm.learning.environments import Columns, Environments, Step
from drake_disasm.learning.random_numbers import Purpose, seed_for
from drake_disasm.learning.training import Training, clock
from drake_disasm.mdp import Outcome
from drake_disasm.task.episode import EpisodeSummary

#: Episodes that have ended, and what is recorded of each.
Ended = list[tuple[EpisodeSummary, Columns | None]]


class _Round:
    """Episodes of a training that begin together, each in a row.

    Args:
        training: whose they are.
        rows: that it may use.
    """

    def __init__(self, training: Training, rows: slice) -> None:
        config, first = training.config, len(training.summaries)
        count = min(rows.stop - rows.start, config.episodes - first)
        numbers = range(first, first + count)
        self.training, self.rows = training, slice(rows.start, rows.start + count)
        self.seeds = [seed_for(training.seed, Purpose.EPISODE, n) for n in numbers]
        self.is_running = training.placed(np.ones(count, bool))
        self.summary = EpisodeSummary(0, bolt_is_out=~self.is_running)  # of all
        self._learns = first >= config.warmup_episodes
        self._every_step = config.schedule == "every_step"
        self._updates = training.generator(Purpose.UPDATES, first)
        self._owed = 0.0
        self._noise = training.noise(first, count)
        sigma = np.array([[training.sigma(n)] for n in numbers], np.float32)
        self._sigma = training.placed(sigma)
        self._seen: Array
        self._chosen: Array

    def act(self, before: Array) -> Array:
        """Returns exploring actions (k, a) for observations (k, s); 0 after an end."""
        training, xp = self.training, namespace(before)
        self._seen = xp.astype(training.view.observe(before), xp.float32)
        self._chosen = training.agent.explore(self._seen, self._noise(), self._sigma)
        actions = training.view.to_action(before, self._chosen)
        return xp.where(self.is_running[:, None], actions, 0.0)

    def take(self, step: Step) -> Array:
        """Takes a step, and learns if each step teaches.

        Returns:
            Which episodes have come to an end that a simulation can judge (k,).
        """
        training, running = self.training, self.is_running
        xp, counts = namespace(running), running & step.counts
        self.summary.add(step, counts)
        self.summary.outcome = xp.where(running, step.outcome, self.summary.outcome)
        training.replay.add(
            self._seen,
            self._chosen,
            step.reward,
            training.view.observe(step.seen),
            step.terminated,
            running & ~step.has_failed,
        )
        goes_on = ~step.has_failed & (step.outcome == Outcome.RUNNING)
        self.is_running = running & goes_on
        if self._every_step:
            self._learn(int(xp.sum(running, dtype=xp.int64)))
        return counts & ~self.is_running

    def end(self) -> list[EpisodeSummary]:
        """Learns from the episodes, if each step did not teach; sums them up."""
        summaries = self.summary.apart(self.seeds)
        if not self._every_step:
            self._learn(sum(summary.steps for summary in summaries))
        self.training.summaries += summaries
        return summaries

    def _learn(self, steps: int) -> None:
        """Learns from so many new steps; less than an update is owed."""
        if self._learns:
            self._owed += self.training.config.updates_per_step * steps
            self.training.learn(int(self._owed), self._updates)
            self._owed %= 1.0


class TrainingLoop:
    """Trains agents in rows of environments, or on their datasets.

    Each training has as many rows as the others. Its episodes begin together, one in
    each of its rows, and form a round; one that ends waits for the others. What it
    learns from is its own. Only the environments are shared: no training waits for
    another's round.

    Args:
        environments: None for trainings on datasets.
        trainings: fresh or restored.
    """

    def __init__(
        self, environments: Environments | None, trainings: Sequence[Training]
    ) -> None:
        self.trainings, self._environments = list(trainings), environments
        self._rounds: dict[int, _Round] = {}
        self._observation: Array = None

    @property
    def unfinished(self) -> list[int]:
        """Numbers of the trainings that have rounds to do."""
        return [i for i, t in enumerate(self.trainings) if not t.is_finished]

    def run_round(self) -> dict[int, Ended]:
        """Goes on until a round ends; returns its episodes, by training.

        The training has learned from them.
        """
        environments = self._environments
        if environments is None:
            unfinished = self.unfinished
            for number in unfinished:
                self.trainings[number].learn_round()
            return {number: [] for number in unfinished}
        self._begin(environments)
        over = list[int]()
        while not over:
            self._step(environments)
            running = {i: bool(r.is_running.any()) for i, r in self._rounds.items()}
            over = [number for number in running if not running[number]]
        ended = dict[int, Ended]()
        for number in over:
            done = self._rounds.pop(number)
            ended[number] = [
                (summary, environments.recorded(row, summary.steps))
                for row, summary in enumerate(done.end(), done.rows.start)
            ]
        return ended

    def _begin(self, environments: Environments) -> None:
        """Begins a round of each training that has none running."""
        new = [number for number in self.unfinished if number not in self._rounds]
        if not new:
            return
        count = environments.count // len(self.trainings)
        begun = {
            i: _Round(self.trainings[i], slice(i * count, (i + 1) * count)) for i in new
        }
        rows = [np.arange(r.rows.start, r.rows.stop) for r in begun.values()]
        seeds = [seed for r in begun.values() for seed in r.seeds]
        with clock([self.trainings[i] for i in new], "simulation"):
            self._observation = environments.begin(np.concatenate(rows), seeds)
        self._rounds |= begun

    def _step(self, environments: Environments) -> None:
        """Takes one step in all rows whose episodes run."""
        rounds, before = list(self._rounds.values()), self._observation
        with clock([r.training for r in rounds], "simulation"):
            chosen = [r.act(before[r.rows]) for r in rounds]
            xp, shape = namespace(before), (environments.count, chosen[0].shape[1])
            actions = xp.zeros(shape, dtype=chosen[0].dtype, device=before.device)
            for r, values in zip(rounds, chosen, strict=True):
                actions[r.rows] = values
            step = environments.step(actions)
        self._observation = step.seen
        judged = [r.take(step.rows(r.rows)) for r in rounds]
        if any(bool(mask.any()) for mask in judged):
            is_out = environments.bolt_is_out()
            for r, mask in zip(rounds, judged, strict=True):
                out = array_like(is_out[r.rows], mask)
                r.summary.bolt_is_out = r.summary.bolt_is_out | (mask & out)
