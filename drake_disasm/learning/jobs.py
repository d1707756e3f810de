"""Trains the seeds of an experiment, each in whatever process it runs."""

import dataclasses
from collections.abc import Collection, Iterable, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

from drake_disasm.common.executors import WorkerPool
from drake_disasm.common.progress import Progress, ProgressUpdate, ignore_progress
from drake_disasm.learning.checkpoint import load_memory
from drake_disasm.learning.dataset import remember
from drake_disasm.learning.environments import (
    Environments,
    make_environments,
)
from drake_disasm.learning.experiment import Experiment, seed_folder
from drake_disasm.learning.replay import Replay
from drake_disasm.learning.run import finish, run_trainings
from drake_disasm.learning.training import Training, make_training, task_view
from drake_disasm.learning.warm_start import start_checkpoint, start_hash
from drake_disasm.logs import LogWriter, read_logs
from drake_disasm.logs.transitions import observations
from drake_disasm.task.recording import transitions_header
from drake_disasm.twin.batch import with_impact


@dataclasses.dataclass(frozen=True)
class SeedJob:
    """One worker's job: the training of one seed.

    Attributes:
        experiment: what all seeds have in common.
        seed: this one's.
        folder: this one's.
    """

    experiment: Experiment
    seed: int
    folder: Path

    @property
    def is_finished(self) -> bool:
        """Whether its result is there."""
        return (self.folder / "result.json").exists()


def seed_jobs(
    experiment: Experiment, seeds: Iterable[int], folder: Path
) -> list[SeedJob]:
    """Returns one job for each seed, in a folder of its own within the folder."""
    return [SeedJob(experiment, s, seed_folder(folder, s)) for s in seeds]


def train_seeds(
    jobs: Sequence[SeedJob],
    workers: int = 1,
    progress: Progress = ignore_progress,
    executor: Executor | None = None,
    host: str = "",
) -> None:
    """Trains all seeds, each in a process of its own if there are several workers.

    Seeds in lockstep share as many processes as there are workers; each is then
    validated in one of its own.

    Args:
        jobs: one for each seed.
        workers: processes.
        progress: gets episodes done, mean reward, and success of the latest.
        executor, host: as of `WorkerPool`; its workers must see the jobs' folders.
    """
    together = [job for job in jobs if job.experiment.lockstep and not job.is_finished]
    groups = [tuple(together[i::workers]) for i in range(min(workers, len(together)))]
    with WorkerPool(
        workers, executor=executor, host=host, process_per_job=True, progress=progress
    ) as pool:
        for _ in pool.run(_train_in_lockstep, groups):
            pass
        for _ in pool.run(train_seed, jobs):
            pass


def _train_in_lockstep(jobs: Sequence[SeedJob], progress: Progress) -> None:
    """Trains some seeds side by side; `train_seed` finishes each."""
    _run(jobs, [_training(job) for job in jobs], progress)


def _run(
    jobs: Sequence[SeedJob], trainings: Sequence[Training], progress: Progress
) -> None:
    """Trains jobs to the end, in the same environments."""
    experiment = jobs[0].experiment
    specs = [job.experiment.spec(job.seed) for job in jobs]

    def make() -> Environments | None:
        """Makes the environments; logs to learn from need none."""
        if experiment.logs:
            return None
        return make_environments(specs, experiment.lockstep, experiment.is_recorded)

    logs = [_log(job) for job in jobs if experiment.is_recorded]
    run_trainings(trainings, make, [job.folder for job in jobs], logs, progress)


def _log(job: SeedJob) -> LogWriter:
    """Returns what writes the seed's log, or goes on with it."""
    experiment = job.experiment
    scenario = experiment.scenario
    if experiment.is_batched:
        scenario = with_impact(scenario)
    provenance = experiment.provenance | {"seed": job.seed}
    header = transitions_header(scenario, experiment.station, provenance)
    return LogWriter(job.folder / "log", header, resume=True)


def train_seed(job: SeedJob, progress: Progress) -> dict[str, Any]:
    """Trains one seed to its end and returns its result."""
    experiment = job.experiment
    if job.is_finished:
        episodes = experiment.config.episodes
        progress(ProgressUpdate("training", episodes, episodes))
        return {}
    provenance = experiment.provenance | {
        "seed": job.seed,
        "preset": experiment.preset,
        "data": experiment.logs | experiment.demonstrations,
    }
    if experiment.start:
        provenance["start"] = {
            experiment.start: start_hash(experiment.start, job.seed),
        }
    training, spec = _training(job), experiment.spec(job.seed)
    _run([job], [training], progress)
    end = (provenance, experiment.validation, progress)
    return finish(training, spec, job.folder, *end)


def _training(job: SeedJob) -> Training:
    """Returns the training of a seed, at its beginning."""
    experiment = job.experiment
    dataset = _memory(experiment, experiment.logs)
    updates = experiment.updates or (dataset.size if dataset else 0)
    training = make_training(
        experiment.spec(job.seed), _demonstrations(job), dataset, updates
    )
    if experiment.start:
        training.start_from(start_checkpoint(experiment.start, job.seed))
    return training


def _demonstrations(job: SeedJob) -> Replay | None:
    """Returns what to mix into each batch: logs, or the start's replay memory."""
    experiment = job.experiment
    shown = _memory(experiment, experiment.demonstrations)
    if shown or not (experiment.start and experiment.config.demonstrations):
        return shown
    path = start_checkpoint(experiment.start, job.seed)
    return load_memory(path, experiment.device)


def _memory(experiment: Experiment, folders: Collection[str]) -> Replay | None:
    """Returns a replay memory of all transitions of some logs, if there are any."""
    scenario, config = experiment.scenario, experiment.config
    if not folders:
        return None
    episodes = [e for log in read_logs(folders) for e in log.episodes]
    count = sum(episode.rows - 1 for episode in episodes)
    replay = Replay(count, device=experiment.device)
    view = task_view(scenario, config)
    for episode in episodes:
        remember(
            replay,
            observations(episode),
            episode["action"][:-1],
            bool(episode["terminated"][-1]),
            scenario,
            view,
        )
    return replay
