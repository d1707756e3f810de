"""Jobs in this process, in several, in threads, and with workers that die."""

import itertools
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import pytest

from drake_disasm.common import executors
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.executors import WorkerPool, import_in_workers
from drake_disasm.common.progress import Progress, ProgressUpdate
from tests.refusals import refusal


def _square(job: int, progress: Progress) -> int:
    for done in range(1, job + 1):
        progress(ProgressUpdate("squaring", done, 3, value=float(job)))
    return job * job


def _dies_once(job: Path, progress: Progress) -> str:
    if not job.exists():
        job.touch()
        os._exit(9)
    return job.name


def _dies(job: int) -> None:
    os._exit(9)


def _refuses(job: int, progress: Progress) -> None:
    raise DisasmError(f"job {job} is bad; give another")


def _reports_until_stopped(job: Path, progress: Progress) -> None:
    """Reports for ever; leaves a file where it is stopped."""
    for done in itertools.count(1):
        try:
            progress(ProgressUpdate("waiting", done))
        except KeyboardInterrupt:
            job.touch()
            raise
        time.sleep(0.01)


@contextmanager
def _pool(kind: str, **options: object) -> Iterator[WorkerPool]:
    """Yields a pool of one kind."""
    with ThreadPoolExecutor(2) as threads:
        chosen = {
            "here": {},
            "processes": {"count": 2, "process_per_job": True},
            "threads": {"executor": threads},
            "network": {"executor": threads, "host": "localhost"},
        }[kind]
        with WorkerPool(**chosen, **options) as pool:  # type: ignore[arg-type]
            yield pool


@pytest.mark.parametrize("kind", ["here", "processes", "threads", "network"])
def test_results_progress_and_errors_come_through(kind: str) -> None:
    seen: list[ProgressUpdate] = []
    with _pool(kind, progress=seen.append) as pool:
        results = dict(pool.run(_square, [1, 2, 3]))
        assert results == {1: 1, 2: 4, 3: 9}
        assert len(seen) == 1 + 2 + 3
        assert seen[-1] == ProgressUpdate("squaring", 1 + 2 + 3, 9, value=2.0)
        with pytest.raises(DisasmError, match="is bad; give another"):
            list(pool.run(_refuses, [1, 2]))


def test_map_keeps_the_order_and_counts() -> None:
    seen: list[ProgressUpdate] = []
    with WorkerPool(2, progress=seen.append, stage="squaring") as pool:
        assert pool.map(abs, [-1, 2, -3]) == [1, 2, 3]
        assert pool.map(abs, [-4]) == [4]
    assert not multiprocessing.active_children()
    assert seen == [ProgressUpdate("squaring", done) for done in (1, 2, 3, 4)]


def test_what_a_dead_worker_left_is_done_again(tmp_path: Path) -> None:
    jobs = [tmp_path / "a", tmp_path / "b"]
    jobs[1].touch()
    with WorkerPool(2) as pool:
        done = dict(pool.run(_dies_once, jobs))
        assert done == dict(zip(jobs, "ab", strict=True))
        assert pool.notes == ["a worker process died; its work was done again"]


def test_workers_that_die_or_cannot_be_reached_are_an_error() -> None:
    with WorkerPool(2) as pool:
        assert "died 3 times over the same work" in refusal(pool.map, _dies, [1])
    with (
        ThreadPoolExecutor(1) as threads,
        WorkerPool(executor=threads, host="192.0.2.1") as pool,
    ):
        assert "cannot listen" in refusal(lambda: list(pool.run(_square, [1])))


class KilledWorker(Exception):  # noqa: N818
    """Stands for Dask's exception of that name."""


@pytest.mark.parametrize("error", [BrokenExecutor, KilledWorker])
def test_a_given_executor_that_lost_its_workers_is_an_error(error) -> None:
    def fail(job: int) -> None:
        raise error("gone")

    with _pool("threads") as pool:
        assert "lost its workers" in refusal(pool.map, fail, [1])


@pytest.mark.parametrize("kind", ["processes", "threads"])
def test_ctrl_c_stops_jobs_at_their_next_update(tmp_path: Path, kind: str) -> None:
    jobs = [tmp_path / name for name in "abcd"]

    def press(update: ProgressUpdate) -> None:
        """Presses Ctrl-C once both workers run."""
        if update.done > 20:
            raise KeyboardInterrupt

    with _pool(kind, progress=press) as pool, pytest.raises(KeyboardInterrupt):
        list(pool.run(_reports_until_stopped, jobs))
    # All have ended by now; those that had not begun never did.
    assert 1 <= len(list(tmp_path.iterdir())) <= 2


_KILLED = """
import os, threading
from drake_disasm.common.executors import WorkerPool

def work(job):
    print(os.getpid(), flush=True)
    threading.Event().wait()

if __name__ == "__main__":
    with WorkerPool(2) as pool:
        pool.map(work, [1, 2])
"""


def test_workers_end_with_a_killed_parent(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(_KILLED)
    command = [sys.executable, script]
    parent = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert parent.stdout
    assert len({parent.stdout.readline() for _ in range(2)}) == 2  # the workers'
    parent.send_signal(signal.SIGKILL)
    parent.wait()
    assert parent.stdout.read() == ""  # ends once nobody holds it any more


def _is_imported(module: str) -> bool:
    return module in sys.modules


def test_workers_import_what_they_are_told_to(tmp_path: Path, monkeypatch) -> None:
    (tmp_path / "registers_something.py").write_text("")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(executors, "_modules", {})
    with WorkerPool(2) as pool:
        assert pool.map(_is_imported, ["registers_something"]) == [False]
        import_in_workers("registers_something")
        assert pool.map(_is_imported, ["registers_something"]) == [True]
        import_in_workers("is_nowhere")
        assert "PYTHONPATH" in refusal(pool.map, _is_imported, ["is_nowhere"])
