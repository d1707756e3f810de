"""How long-running library calls report their progress to whoever called them."""

import math
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class ProgressUpdate:
    """What a long-running call reports while it runs.

    Attributes:
        stage: what is being done, such as "simulating" or "training".
        done: units of work finished in this stage, counted from its start.
        total: units of work in this stage; 0 if it is not known.
        message: with a count (`done` or `total`), a remark that is shown next to it;
            without one, a line of its own.
        value: figure of merit so far, such as the objective or the reward; NaN for
            none.
    """

    stage: str
    done: int = 0
    total: int = 0
    message: str = ""
    value: float = math.nan


#: Receives progress updates. It may raise, KeyboardInterrupt for one, to stop the call.
Progress = Callable[[ProgressUpdate], None]


def ignore_progress(update: ProgressUpdate) -> None:
    """Does nothing with a progress update: the default of library calls."""


class CombinedProgress:
    """Adds up the progress of jobs that run side by side.

    A stage's count is the sum over the jobs. Jobs that have not reported yet count as
    large as those that have; the value is the mean over the jobs.
    """

    def __init__(self, progress: Progress, jobs: int) -> None:
        """Has heard of nothing yet.

        Args:
            progress: gets what is added up.
            jobs: how many there are.
        """
        self._progress, self._jobs = progress, jobs
        self._latest: dict[str, dict[int, ProgressUpdate]] = {}

    def __call__(self, job: int, update: ProgressUpdate) -> None:
        """Passes on what an update of a job makes of the sum.

        Args:
            job: its number.
            update: its own progress.
        """
        if not (update.done or update.total):
            self._progress(update)
            return
        latest = self._latest.setdefault(update.stage, {})
        latest[job] = update
        values = [u.value for u in latest.values() if math.isfinite(u.value)]
        total = sum(u.total for u in latest.values())
        combined = ProgressUpdate(
            stage=update.stage,
            done=sum(u.done for u in latest.values()),
            total=round(total * self._jobs / len(latest)),
            message=update.message,
            value=sum(values) / len(values) if values else math.nan,
        )
        self._progress(combined)
