"""A study on a Dask cluster: same bits, workers that die, and what is refused."""

import contextlib
import os
import random
import signal
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from drake_disasm.common.cluster import executor_for
from drake_disasm.common.errors import DisasmError
from drake_disasm.studies.runner import open_study, run_study
from drake_disasm.studies.study import Study
from tests.drake_disasm.studies.test_study import bits, small_precision
from tests.progress import wait_until

distributed = pytest.importorskip("distributed")


@contextlib.contextmanager
def cluster_of(workers: int) -> Iterator["distributed.LocalCluster"]:
    """Yields a cluster whose workers are processes."""
    with distributed.LocalCluster(
        n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=":0"
    ) as cluster:
        yield cluster


def _run_here(study: Study, folder: Path, workers: int) -> dict[str, str]:
    open_study(study, folder, resume=False)
    run_study(study, folder, workers)
    return bits(folder)


def _run_and_kill_two(study: Study, folder: Path, workers: int) -> dict[str, str]:
    """Runs a study on a cluster, of which two workers at random are killed.

    One after the other, once episodes are written.
    """
    killed: list[int] = []
    with cluster_of(workers) as cluster:

        def kill() -> None:
            """Kills the two."""
            for worker in random.sample(list(cluster.workers.values()), 2):
                wait_until(lambda: len(list(folder.rglob("episode_*"))) > len(killed))
                os.kill(worker.process.pid, signal.SIGKILL)
                killed.append(worker.process.pid)

        thread = threading.Thread(target=kill)
        thread.start()
        open_study(study, folder, resume=False)
        address = cluster.scheduler_address
        with executor_for("dask", address) as (executor, host):
            run_study(study, folder, workers, executor, host)
        thread.join()
    assert len(killed) == 2
    return bits(folder)


def test_workers_that_are_killed_change_no_bit(tmp_path: Path) -> None:
    study = small_precision(lockstep=False, seeds=(0,))
    alone = _run_here(study, tmp_path / "alone", 1)
    assert _run_and_kill_two(study, tmp_path / "cluster", 2) == alone


@pytest.mark.slow
def test_one_worker_four_and_a_cluster_of_four_give_the_same_bits(
    tmp_path: Path,
) -> None:
    study = small_precision(lockstep=False, seeds=(0, 1))
    alone = _run_here(study, tmp_path / "one", 1)
    assert _run_here(study, tmp_path / "four", 4) == alone
    assert _run_and_kill_two(study, tmp_path / "cluster", 4) == alone


def test_a_scheduler_that_does_not_answer_is_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("drake_disasm.common.cluster._PATIENCE", 0.5)
    with (
        pytest.raises(DisasmError, match=r"127.0.0.1:9: does not answer"),
        executor_for("dask", "tcp://127.0.0.1:9"),
    ):
        pass


def test_a_cluster_without_workers_is_refused() -> None:
    with (
        distributed.LocalCluster(n_workers=0, dashboard_address=":0") as cluster,
        pytest.raises(DisasmError, match="has no workers"),
        executor_for("dask", cluster.scheduler_address),
    ):
        pass


def test_workers_with_other_versions_are_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def differ(*_: object, **__: object) -> None:
        """Finds what Dask finds where versions differ."""
        raise ValueError("Mismatched versions found: numpy")

    monkeypatch.setattr(distributed.Client, "get_versions", differ)
    with (
        distributed.LocalCluster(
            n_workers=1, processes=False, dashboard_address=":0"
        ) as cluster,
        pytest.raises(DisasmError, match=r"other versions .*numpy"),
        executor_for("dask", cluster.scheduler_address),
    ):
        pass


@pytest.mark.parametrize(
    ("name", "scheduler", "said"),
    [("dask", "", "give the scheduler's address"), ("local", "x", "add --executor")],
)
def test_an_executor_and_a_scheduler_go_together(
    name: str, scheduler: str, said: str
) -> None:
    with pytest.raises(DisasmError, match=said), executor_for(name, scheduler):
        pass
