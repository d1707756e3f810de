"""Episodes: running one, and summing it up."""

import dataclasses
from collections.abc import Sequence
from typing import Any, Protocol

from drake_disasm.common.arrays import Array, as_number, at_least, to_numpy
from drake_disasm.common.errors import DivergedError, UnreachableError
from drake_disasm.common.progress import Progress, ProgressUpdate
from drake_disasm.effects import Effect
from drake_disasm.mdp import REWARD_TERMS, BoltState, Outcome
from drake_disasm.task.simulation import StepResult, TaskSimulation

_MM = 1000.0


@dataclasses.dataclass
class EpisodeSummary:
    """One row of the table that a run ends with; or n of them, each field (n,).

    Attributes:
        seed: of the episode.
        steps: taken.
        reward_terms: summed by name.
        travel, rise: largest displacement of the bolt along x and y, as the reward
            counts it: what it has yielded in the grip included [m].
        max_force, mean_force: on the bolt [N].
        max_torque, mean_torque: on the bolt [N m].
        outcome: how it ended.
        bolt_is_out: whether the bolt truly left the groove (simulation only).
    """

    seed: int
    steps: int = 0
    reward_terms: dict[str, float] = dataclasses.field(default_factory=dict)
    travel: float = 0.0
    rise: float = 0.0
    max_force: float = 0.0
    mean_force: float = 0.0
    max_torque: float = 0.0
    mean_torque: float = 0.0
    outcome: Outcome = Outcome.RUNNING
    bolt_is_out: bool = False

    @property
    def reward(self) -> float:
        """Sum of all terms over the episode."""
        return sum(self.reward_terms.values())

    def add(self, result: Any, counts: Array | bool = True) -> None:
        """Takes one more step into account.

        Args:
            result: a StepResult; of n episodes its fields have them as first axis.
            counts: (n,) whether each has taken that step; their outcomes are the
                caller's to keep.
        """
        state = BoltState.from_vector(result.observation)
        self.steps = self.steps + counts
        for name, value in result.reward_terms.items():
            self.reward_terms[name] = self.reward_terms.get(name, 0.0) + counts * value
        for name, value in (
            ("travel", as_number(result.place[..., 0])),
            ("rise", as_number(result.place[..., 1])),
            ("max_force", state.force),
            ("max_torque", state.torque),
        ):
            setattr(self, name, at_least(getattr(self, name), counts * value))
        steps = at_least(1, self.steps)
        for name, value in (("mean_force", state.force), ("mean_torque", state.torque)):
            mean = getattr(self, name)
            setattr(self, name, mean + counts * (value - mean) / steps)
        if counts is True:
            self.outcome = result.outcome

    def apart(self, seeds: Sequence[int]) -> "list[EpisodeSummary]":
        """Returns n summaries, one by one.

        Args:
            seeds: of each.
        """
        plain = [f.name for f in dataclasses.fields(self)]
        plain = [name for name in plain if name not in ("seed", "reward_terms")]
        columns = {name: to_numpy(getattr(self, name)).tolist() for name in plain}
        columns["outcome"] = [Outcome(number) for number in columns["outcome"]]
        terms = {n: to_numpy(v).tolist() for n, v in self.reward_terms.items()}
        return [
            EpisodeSummary(
                seed=seed,
                reward_terms={name: values[i] for name, values in terms.items()},
                **{name: values[i] for name, values in columns.items()},
            )
            for i, seed in enumerate(seeds)
        ]


class Recorder(Protocol):
    """What records the rows of an episode; see `recording.EpisodeRecorder`."""

    def measure(self) -> None:
        """Records what is measured at the start of the episode."""

    def acted(self, result: StepResult) -> None:
        """Records a step and what is measured after it."""


def run_episode(
    simulation: TaskSimulation,
    seed: int,
    recorder: Recorder | None = None,
    progress: Progress | None = None,
    effects: Sequence[Effect] | None = None,
    is_judged: bool = False,
) -> EpisodeSummary:
    """Runs one episode of a simulation that has a policy.

    Args:
        simulation: its diagram holds the policy.
        seed: of the episode.
        recorder: gets every row, if given; up to an error, too.
        progress: updated after each step; its value is the reward so far.
        effects: instead of the scenario's.
        is_judged: whether a policy that leads the arm beyond its limits, or has the
            simulation diverge, has left the workspace, and that is its outcome.

    Raises:
        DisasmError: what the policy raised or returned.
        UnreachableError: the arm can't follow, and the policy is not judged.
        DivergedError: the simulation has diverged, and the policy is not judged.
    """
    summary = EpisodeSummary(seed)
    simulation.reset(seed, effects)
    if recorder:
        recorder.measure()
    while summary.outcome is Outcome.RUNNING:
        try:
            result = simulation.step()
        except (UnreachableError, DivergedError) as error:
            if not is_judged:
                raise
            summary.outcome = Outcome.WORKSPACE
            if isinstance(error, DivergedError):
                return summary  # nobody can say where the bolt is
            break
        summary.add(result)
        if recorder:
            recorder.acted(result)
        if progress:
            progress(_progress(summary, simulation.scenario.task.steps))
    summary.bolt_is_out = simulation.bolt_is_out()
    return summary


def _progress(summary: EpisodeSummary, steps: int) -> ProgressUpdate:
    return ProgressUpdate(
        f"seed {summary.seed}",
        summary.steps,
        steps,
        f"max_F={summary.max_force:.1f} N",
        summary.reward,
    )


_HEADER = (
    "episode seed  steps   reward "
    + " ".join(f"{name:>8}" for name in REWARD_TERMS)
    + "   travel     rise  max F mean F   max T  outcome"
)
_UNITS = (
    "                                                                  "
    "     mm       mm      N      N     N m"
)


def summary_table(summaries: list[EpisodeSummary]) -> str:
    """Returns the episodes as a table for a terminal."""
    lines = [_HEADER, _UNITS]
    lines += [_table_row(i, summary) for i, summary in enumerate(summaries)]
    successes = sum(s.outcome is Outcome.SUCCESS for s in summaries)
    lines.append(f"{successes} of {len(summaries)} episodes succeeded")
    return "\n".join(lines)


def _table_row(number: int, s: EpisodeSummary) -> str:
    terms = [s.reward_terms.get(name, 0.0) for name in REWARD_TERMS]
    out = " (the bolt is out)" if s.bolt_is_out else ""
    return (
        f"{number:7d} {s.seed:4d} {s.steps:6d} {s.reward:8.2f} "
        + " ".join(f"{term:8.2f}" for term in terms)
        + f" {s.travel * _MM:8.2f} {s.rise * _MM:8.2f} {s.max_force:6.2f} "
        f"{s.mean_force:6.2f} {s.max_torque:7.3f}  {s.outcome.label}{out}"
    )
