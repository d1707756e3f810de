"""Work in parallel on the workers of a `concurrent.futures.Executor`.

`WorkerPool` is the one way in which the project does so: with processes of its own,
or on any executor that is given, such as Dask's `Client.get_executor()`.
"""

import contextlib
import importlib
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from concurrent.futures import (
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    wait,
)
from functools import partial
from queue import SimpleQueue
from typing import Any, Self, TypeVar

from drake_disasm.common import drake_warnings
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.progress import (
    CombinedProgress,
    Progress,
    ProgressUpdate,
    ignore_progress,
)
from drake_disasm.common.progress_server import Link, ProgressServer

Job = TypeVar("Job")
Result = TypeVar("Result")

_ATTEMPTS = 3  # in a row that finish no job

_modules: dict[str, None] = {}  # in the order in which they were named


def import_in_workers(module: str) -> None:
    """Has workers import a module before each job, such as one that defines effects.

    A spawned process knows only what its job refers to; what is looked up in a
    registry by its name has to be registered there, too.
    """
    _modules[module] = None


class WorkerPool:
    """Runs jobs on an executor's workers, and again where workers died.

    Its own workers are spawned, never forked: threads of Drake and torch do not
    survive a fork. They leave Ctrl-C to this process, and end with it even if it is
    killed.

    Attributes:
        notes: what a report should say, such as workers that died.
    """

    def __init__(
        self,
        count: int = 1,
        *,
        executor: Executor | None = None,
        process_per_job: bool = False,
        progress: Progress = ignore_progress,
        stage: str = "working",
        host: str = "",
    ) -> None:
        """Starts nothing yet.

        Args:
            count: processes; with 1 the work is done in this process.
            executor: does the work instead; whoever made it shuts it down.
            process_per_job: whether each job gets a fresh process, with which the
                memory that it used goes. A single job then runs in this process.
            progress: called in this process as work gets done; may raise to stop.
            stage: of the jobs of `map`, in its updates.
            host: name under which workers on other machines reach this one; "" for
                workers on this machine.
        """
        self.notes: list[str] = []
        self._count, self._process_per_job = count, process_per_job
        self._given, self._host = executor, host
        self._own: Executor | None = None
        self._progress, self._stage, self._done = progress, stage, 0

    @property
    def in_this_process(self) -> bool:
        """Whether there are no workers: jobs run here, one after the other."""
        return self._given is None and self._count == 1

    def map(
        self, function: Callable[[Job], Result], jobs: Sequence[Job]
    ) -> list[Result]:
        """Returns what a function makes of each job, in their order.

        Args:
            function: of a module, so that it can be sent to a process.
            jobs: each sent to a worker.

        Raises:
            DisasmError: workers died again and again, or the function raised it.
        """
        if self.in_this_process:
            return [self.counted(function(job)) for job in jobs]
        found = {
            index: self.counted(result)
            for index, result in self._completed(function, jobs)
        }
        return [found[index] for index in range(len(jobs))]

    def run(
        self, function: Callable[[Job, Progress], Result], jobs: Sequence[Job]
    ) -> Iterator[tuple[Job, Result]]:
        """Yields each job and its result, as they come.

        The progress of all jobs is added up. On Ctrl-C or an error the other jobs
        stop at their next update.

        Args:
            function: of a module; called with a job and with what takes its progress.
            jobs: each sent to a worker.

        Raises:
            DisasmError: workers died again and again, or the function raised it.
        """
        combined = CombinedProgress(self._progress, len(jobs))
        single = self._process_per_job and len(jobs) == 1 and self._given is None
        if self.in_this_process or single:
            for i, job in enumerate(jobs):
                yield job, function(job, partial(combined, i))
            return
        for index, result in self._completed(function, jobs, combined):
            yield jobs[index], result

    def close(self, wait: bool = False) -> None:
        """Ends its own workers; the next work starts new ones.

        Args:
            wait: whether to return only when they are gone.
        """
        if self._own:
            # Not waiting for a pool that replaces its processes fails in its thread.
            wait = wait or self._process_per_job
            self._own.shutdown(wait=wait, cancel_futures=True)
        self._own = None

    def counted(self, result: Result) -> Result:
        """Returns a result, and reports that one more job is done."""
        self._done += 1
        self._progress(ProgressUpdate(self._stage, self._done))
        return result

    def _completed(
        self,
        function: Callable[..., Result],
        jobs: Sequence[Any],
        combined: CombinedProgress | None = None,
    ) -> Iterator[tuple[int, Result]]:
        """Yields number and result of each job; does again what died with a worker."""
        left = dict(enumerate(jobs))
        failures = 0
        while left:
            count = len(left)
            try:
                for index, result in self._attempt(function, left, combined):
                    del left[index]
                    yield index, result
            except BrokenExecutor as error:
                failures = failures + 1 if len(left) == count else 1
                self._replace_workers(failures, error)

    def _attempt(
        self,
        function: Callable[..., Result],
        jobs: Mapping[int, Any],
        combined: CombinedProgress | None,
    ) -> Iterator[tuple[int, Result]]:
        """Yields what one set of workers finishes; raises what a job raised."""
        futures: dict[Future[Result], int] = {}
        with contextlib.ExitStack() as stack:
            server = (
                stack.enter_context(ProgressServer(self._host)) if combined else None
            )
            stack.callback(_abandon, futures, server)
            events = server.events if server else SimpleQueue()
            executor, modules = self._executor(len(jobs)), tuple(_modules)
            for i, job in jobs.items():
                link = server.link(i) if server else None
                future = executor.submit(_call, modules, function, job, link)
                futures[future] = i
                future.add_done_callback(events.put)
            while futures:
                event = events.get()
                if isinstance(event, Future):
                    yield futures.pop(event), _result(event)
                elif combined:
                    combined(*event)

    def _executor(self, jobs: int) -> Executor:
        """Returns what is given, or its own processes, which last until `close`."""
        if self._given:
            return self._given
        if self._own is None:
            self._own = ProcessPoolExecutor(
                min(self._count, jobs) if self._process_per_job else self._count,
                multiprocessing.get_context("spawn"),
                _begin_worker,
                (drake_warnings.are_kept_back(),),
                max_tasks_per_child=1 if self._process_per_job else None,
            )
        return self._own

    def _replace_workers(self, failures: int, error: BrokenExecutor) -> None:
        if self._given:
            raise DisasmError(
                f"the executor lost its workers or its scheduler ({error}); see their "
                "logs (out of memory?), then resume"
            ) from error
        if failures == _ATTEMPTS:
            raise DisasmError(
                f"worker processes died {failures} times over the same work (out of "
                "memory?); give fewer `workers`, then resume"
            ) from error
        self.notes.append("a worker process died; its work was done again")
        self.close()

    def __enter__(self) -> Self:
        """Returns the pool."""
        return self

    def __exit__(self, error: type[BaseException] | None, *_: object) -> None:
        """Ends its own workers; does not wait for them after an error."""
        # Python's exit writes to a closed pipe if it meets a pool that is ending.
        self.close(wait=error is None)


def _call(
    modules: Sequence[str],
    function: Callable[..., Result],
    job: Any,
    link: Link | None,
) -> Result:
    """Does one job, in the worker."""
    for module in modules:
        _import(module)
    if link is None:
        return function(job)
    with link.connected() as progress:
        return function(job, progress)


def _import(module: str) -> None:
    try:
        importlib.import_module(module)
    except ImportError as error:
        raise DisasmError(
            f"module {module}: workers cannot import it ({error}); put its folder on "
            "PYTHONPATH"
        ) from error


def _result(future: Future[Result]) -> Result:
    try:
        return future.result()
    except CancelledError as error:  # not by this program: its scheduler went away
        raise BrokenExecutor("its work was cancelled") from error
    except Exception as error:
        if type(error).__name__ == "KilledWorker":  # Dask's, after trying again itself
            raise BrokenExecutor(str(error)) from error
        raise


def _abandon(futures: Collection[Future[Any]], server: ProgressServer | None) -> None:
    """Ends what is not finished; waits for running jobs if they can be stopped."""
    for future in futures:
        future.cancel()
    if server:
        server.stop_jobs()
        wait(futures)


def _begin_worker(quiet: bool) -> None:
    """Leaves Ctrl-C to the main process, and ends this one with it.

    Args:
        quiet: whether Drake's warnings, which the main process counts, are kept back.
    """
    if quiet:
        drake_warnings.keep_back()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
