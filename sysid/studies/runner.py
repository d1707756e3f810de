"""Does a study's work: resumable job by job, on whatever executor there is."""

import dataclasses
import functools
import json
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.executors import WorkerPool
from drake_disasm.common.files import make_folder, read_json, write_json
from drake_disasm.common.finished_work import is_resumed, refuse_difference
from drake_disasm.common.progress import Progress, ProgressUpdate, ignore_progress
from drake_disasm.learning.evaluation import evaluate, summed_up
from drake_disasm.learning.experiment import (
    open_experiment,
    read_evaluation,
    read_result,
    write_summary,
)
from drake_disasm.learning.jobs import SeedJob, seed_jobs, train_seeds
from drake_disasm.policies import resolve_policy
from drake_disasm.task.simulation import TaskSimulation
from sysid.studies.study import (
    PolicyTest,
    Preparation,
    Stage,
    Study,
    Treatment,
)

_MARKER = "study.json"
_NEW = "give a new folder"
#: More of a study may be asked for when it is resumed.
_MAY_GROW = ("seeds", "levels", "compare", "robot_episodes")


def open_study(study: Study, folder: Path, resume: bool) -> dict[str, Any]:
    """Makes the study's folder, or finds the same study in it.

    More levels and seeds may be asked for than before.

    Args:
        study: with the user's options.
        folder: of the study.
        resume: whether to go on with what is there.

    Returns:
        What `study.json` holds: the options, and the provenance of its beginning.

    Raises:
        DisasmError: the folder holds something else or another study, or a study and
            `resume` is false.
    """
    options = dataclasses.asdict(study.options)
    for name in _MAY_GROW:
        del options[name]
    wanted = json.loads(json.dumps({"study": study.name} | options))
    if not is_resumed(folder, _MARKER, "a study", resume):
        write_json(folder / _MARKER, wanted)
        return wanted
    found = read_json(folder / _MARKER, _NEW, {"study": "", "provenance": {}})
    if found["study"] != study.name:
        raise DisasmError(
            f"{folder}: holds the study '{found['study']}', not '{study.name}'; {_NEW}"
        )
    del wanted["provenance"]
    refuse_difference(folder, found, wanted)
    return found


def run_study(
    study: Study,
    folder: Path,
    workers: int = 1,
    executor: Executor | None = None,
    host: str = "",
    progress: Progress = ignore_progress,
) -> None:
    """Does all of a study that is not finished yet.

    Results are the same bits whatever does the work.

    Args:
        study: whose folder is open.
        folder: of the study; an executor's workers must see it, too.
        workers: processes, or jobs at a time on an executor.
        executor: does the work instead of processes of this program.
        host: as in `WorkerPool`.
        progress: gets what is done of each stage.
    """
    for stage in study.stages(folder):
        todo = [each for each in stage.preparations if not each.is_finished]
        tests = [test for test in stage.tests if not test.path.exists()]
        pool = functools.partial(
            WorkerPool,
            workers,
            executor=executor,
            host=host,
            process_per_job=True,
            progress=progress,
        )
        _run_all(pool, prepare, todo)
        jobs = _jobs(stage, folder)
        if jobs:
            train_seeds(jobs, workers, progress, executor=executor, host=host)
            for treatment in stage.treatments:
                write_summary(folder / treatment.folder)
        _run_all(pool, run_test, tests)


def _run_all(
    make_pool: Callable[[], WorkerPool],
    function: Callable[[Any, Progress], None],
    jobs: Sequence[Any],
) -> None:
    """Does jobs in a pool of workers."""
    with make_pool() as pool:
        for _ in pool.run(function, jobs):
            pass


def prepare(job: Preparation, progress: Progress) -> None:
    """Does a preparation."""
    job(progress)


def _jobs(stage: Stage, folder: Path) -> list[SeedJob]:
    """Returns the trainings of a stage, one for each seed of each treatment."""
    jobs = list[SeedJob]()
    for treatment in stage.treatments:
        own = folder / treatment.folder
        experiment = open_experiment(treatment.experiment, own, resume=True)
        jobs += seed_jobs(experiment, stage.seeds, own)
    return jobs


def run_test(job: PolicyTest, progress: Progress) -> None:
    """Runs a policy's greedy episodes and writes their figures."""
    policy = resolve_policy(job.policy, job.scenario)
    simulation = TaskSimulation(job.scenario, job.station, policy)

    def told(update: ProgressUpdate) -> None:
        """Passes progress on under the name of the stage."""
        progress(dataclasses.replace(update, stage="testing policies"))

    figures = summed_up(evaluate(simulation, job.seeds, progress=told))
    make_folder(job.path.parent)
    write_json(job.path, dataclasses.asdict(figures))


@dataclasses.dataclass(frozen=True)
class SeedResult:
    """What one seed of a treatment came to.

    Attributes:
        treatment: of which.
        seed: which.
        figures: content of its `result.json`.
        folder: of the seed.
    """

    treatment: Treatment
    seed: int
    figures: dict[str, Any]
    folder: Path

    @property
    def has_succeeded(self) -> bool:
        """Whether any of its training's episodes did (table 3.2)."""
        return self.figures["first_success"] is not None

    @property
    def validation(self) -> dict[str, Any]:
        """Its policy's greedy episodes (`Evaluation`)."""
        return dict(self.figures["validation"])

    def test(self, name: str) -> dict[str, Any] | None:
        """Returns the figures of a test of its policy, if that is finished."""
        return read_test(test_path(self.folder, name))


def read_test(path: Path) -> dict[str, Any] | None:
    """Returns the figures of a test, if it is finished."""
    return read_evaluation(path) if path.exists() else None


def test_path(folder: Path, name: str) -> Path:
    """Returns where a test of a seed's policy is written."""
    return folder / "tests" / f"{name}.json"


def finished(
    treatments: list[Treatment], seeds: tuple[int, ...], folder: Path
) -> list[SeedResult]:
    """Returns what is finished of some treatments, in their order."""
    return list(_finished(treatments, seeds, folder))


def _finished(
    treatments: list[Treatment], seeds: tuple[int, ...], folder: Path
) -> Iterator[SeedResult]:
    for treatment in treatments:
        for job in seed_jobs(treatment.experiment, seeds, folder / treatment.folder):
            if job.is_finished:
                result = read_result(job.folder / "result.json")
                yield SeedResult(treatment, job.seed, result, job.folder)
