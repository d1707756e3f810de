"""Jobs in one process, in several, and with workers that die."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.executors import run_jobs


def _square(job: int, report: Callable[[Any], None]) -> int:
    report(job)
    return job * job


def _dies_once(job: Path, report: Callable[[Any], None]) -> str:
    if not job.exists():
        job.touch()
        os._exit(9)
    return job.name


def _dies(job: int, report: Callable[[Any], None]) -> None:
    os._exit(9)


def _refuses(job: int, report: Callable[[Any], None]) -> None:
    raise DisasmError(f"job {job} is bad; give another")


@pytest.mark.parametrize("workers", [1, 2])
def test_results_and_news_come_through(workers: int) -> None:
    news: list[int] = []
    results = dict(run_jobs(_square, [1, 2, 3], workers, news.append))
    assert results == {1: 1, 2: 4, 3: 9}
    assert sorted(news) == [1, 2, 3]


def test_what_a_dead_worker_left_is_begun_again(tmp_path: Path) -> None:
    jobs = [tmp_path / "a", tmp_path / "b"]
    jobs[1].touch()
    results = dict(run_jobs(_dies_once, jobs, 2, lambda _: None))
    assert results == {jobs[0]: "a", jobs[1]: "b"}


def test_workers_that_die_twice_are_an_error() -> None:
    with pytest.raises(DisasmError, match="died twice over 1"):
        list(run_jobs(_dies, [1, 2], 2, lambda _: None))


@pytest.mark.parametrize("workers", [1, 2])
def test_what_a_job_raises_is_raised(workers: int) -> None:
    with pytest.raises(DisasmError, match="is bad; give another"):
        list(run_jobs(_refuses, [1, 2], workers, lambda _: None))
