"""Greedy episodes of policies on the twins of a verdict: one job for each."""

import dataclasses
import hashlib
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from drake_disasm.common.executors import WorkerPool
from drake_disasm.common.files import read_bytes
from drake_disasm.common.finished_work import FinishedWork
from drake_disasm.common.progress import Progress, ProgressUpdate
from drake_disasm.mdp import Outcome
from drake_disasm.policies import find_policy, resolve_policy, scenario_hash
from drake_disasm.scenario import Scenario
from drake_disasm.task.diagram import LoadAtStartWarning
from drake_disasm.task.episode import run_episode
from drake_disasm.task.simulation import TaskSimulation

_MOST_BYTES = 2**28  # of a policy's file
#: The twin at the verdict's values, at a draw from its intervals, without its effects.
TwinKind = Literal["values", "draw", "nominal"]


@dataclass(frozen=True)
class Trial:
    """A greedy episode of a policy on a twin.

    Attributes:
        seed: of noise, and of what is drawn.
        outcome: how it ended.
        drawn: values of the parameters that were drawn, by name.
        duration: of the episode [s].
        mean_force, peak_force: on the bolt [N].
        mean_torque, peak_torque: on the bolt [N m].
    """

    seed: int
    outcome: Outcome
    drawn: dict[str, float]
    duration: float
    mean_force: float
    peak_force: float
    mean_torque: float
    peak_torque: float

    @property
    def succeeded(self) -> bool:
        """Whether the task was done within the limits of force and torque."""
        return self.outcome is Outcome.SUCCESS

    def to_mapping(self) -> dict[str, Any]:
        """Returns it as plain data."""
        return dataclasses.asdict(self) | {"outcome": self.outcome.name}

    @classmethod
    def from_mapping(cls, mapping: dict[str, Any]) -> "Trial":
        """Returns the trial of plain data."""
        return cls(**mapping | {"outcome": Outcome[mapping["outcome"]]})


@dataclass(frozen=True)
class TrialJob:
    """A trial that is to be run.

    Attributes:
        policy: its name, as of `resolve_policy`.
        twin: which.
        scenario: of the twin.
        seed: of the episode.
    """

    policy: str
    twin: TwinKind
    scenario: Scenario
    seed: int


def run_trials(
    jobs: Sequence[TrialJob], workers: int, folder: Path | None, progress: Progress
) -> Iterator[tuple[TrialJob, Trial]]:
    """Yields each job and its trial, in any order.

    Args:
        jobs: to be run.
        workers: processes.
        folder: keeps trials: those of the same job are there already.
        progress: counts episodes.
    """
    finished, todo = FinishedWork(folder), list[TrialJob]()
    hashes = {id(j.scenario): scenario_hash(j.scenario) for j in jobs}
    digests = {name: _digest(name) for name in {j.policy for j in jobs}}

    def key(job: TrialJob) -> list[Any]:
        """Returns what a trial depends on."""
        which = [job.policy, digests[job.policy], hashes[id(job.scenario)]]
        return [*which, job.seed]

    for job in jobs:
        kept = finished.get(key(job))
        if kept is None:
            todo.append(job)
        else:
            yield job, Trial.from_mapping(kept)
    with WorkerPool(workers, progress=progress) as pool:
        for done, trial in pool.run(run_trial, todo):
            finished.keep(key(done), trial.to_mapping())
            yield done, trial


def try_twin(scenario: Scenario) -> None:
    """Begins an episode of a twin; what is wrong with it is said here, and once.

    Raises:
        DisasmError: the twin can't have an effect, or can't begin.
    """
    TaskSimulation(scenario, "twin").reset(0)


def run_trial(job: TrialJob, progress: Progress) -> Trial:
    """Runs a trial; what the policy raises passes through."""

    def told(_: ProgressUpdate) -> None:
        """Gives whoever waits a chance to stop the episode."""
        progress(ProgressUpdate("trying policies", 0, 1))

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", LoadAtStartWarning)  # `try_twin` says so once
        policy = resolve_policy(job.policy, job.scenario)
        simulation = TaskSimulation(job.scenario, "twin", policy)
        done = run_episode(simulation, job.seed, progress=told, is_judged=True)
    progress(ProgressUpdate("trying policies", 1, 1))
    return Trial(
        seed=job.seed,
        outcome=done.outcome,
        drawn=dict(simulation.drawn),
        duration=done.steps * job.scenario.task.period,
        mean_force=done.mean_force,
        peak_force=done.max_force,
        mean_torque=done.mean_torque,
        peak_torque=done.max_torque,
    )


def _digest(name: str) -> str:
    """Returns a hash of a policy's file; empty for one that is in no file."""
    path = find_policy(name) or Path(name.rpartition(":")[0])
    if not path.is_file():
        return ""
    return hashlib.sha256(read_bytes(path, "name another", _MOST_BYTES)).hexdigest()
