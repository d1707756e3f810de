"""Independent jobs on several processes, with news from them while they run."""

import contextlib
import multiprocessing
import os
import queue
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from drake_disasm.common.errors import DisasmError

#: What a job tells while it runs; it may be told to stop by a KeyboardInterrupt.
Report = Callable[[Any], None]
_POLL = 0.1  # s between looks at the news
_ATTEMPTS = 2

_channel: tuple[Any, Any] | None = None


def run_jobs(
    work: Callable[[Any, Report], Any],
    jobs: Sequence[Any],
    workers: int,
    on_news: Report,
) -> Iterator[tuple[Any, Any]]:
    """Yields each job and its result as they come.

    With one worker the jobs run here, one after the other. With more, each runs in
    a fresh interpreter of a pool (spawned, never forked: threads of Drake and torch
    do not survive a fork). If a worker dies, what was unfinished is begun once
    more; work that keeps checkpoints goes on from those. Ctrl-C stops every worker
    at its next report.

    Args:
        work: called with a job and a function that takes news; both it and the jobs
            go through pickle.
        jobs: what to do.
        workers: processes.
        on_news: called here with each piece of news.

    Raises:
        DisasmError: a job's workers died twice, or what the work raised.
    """
    if workers == 1 or len(jobs) == 1:
        for job in jobs:
            yield job, work(job, on_news)
        return
    left = list(jobs)
    for _ in range(_ATTEMPTS):
        for job, result in _pooled(work, list(left), workers, on_news):
            left.remove(job)
            yield job, result
        if not left:
            return
    raise DisasmError(
        f"worker processes died twice over {left[0]} (out of memory?); "
        "give fewer --workers, then resume"
    )


def _pooled(
    work: Callable[[Any, Report], Any],
    jobs: list[Any],
    workers: int,
    on_news: Report,
) -> Iterator[tuple[Any, Any]]:
    """Yields what one pool finishes; ends early if a worker dies."""
    context = multiprocessing.get_context("spawn")
    news, stop = context.Queue(), context.Event()
    with ProcessPoolExecutor(
        min(workers, len(jobs)),
        context,
        _begin_worker,
        (news, stop),
        max_tasks_per_child=1,  # what a job leaves behind in memory goes with it
    ) as pool:
        pending: dict[Future[Any], Any] = {
            pool.submit(_run, work, job): job for job in jobs
        }
        try:
            while pending:
                done, _ = wait(pending, _POLL, FIRST_COMPLETED)
                _pass_on(news, on_news)
                for future in done:
                    yield pending.pop(future), future.result()
        except BrokenProcessPool:
            return
        finally:
            stop.set()
            pool.shutdown(cancel_futures=True)
            _pass_on(news, on_news)


def _pass_on(news: Any, on_news: Report) -> None:
    with contextlib.suppress(queue.Empty):
        while True:
            on_news(news.get_nowait())


def _begin_worker(news: Any, stop: Any) -> None:
    global _channel
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent tells when to stop
    _channel = news, stop


def _run(work: Callable[[Any, Report], Any], job: Any) -> Any:
    assert _channel is not None
    news, stop = _channel
    parent = multiprocessing.parent_process()

    def report(item: Any) -> None:
        """Passes news on, and stops the job if it is to stop."""
        if parent is not None and not parent.is_alive():
            os._exit(1)  # killed: nobody waits for this any more
        if stop.is_set():
            raise KeyboardInterrupt
        if item is not None:
            news.put(item)

    return work(job, report)
