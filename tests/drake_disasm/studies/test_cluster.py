"""A study on a Dask cluster: same bits, and what is refused."""

from pathlib import Path

import pytest

from drake_disasm.common.cluster import executor_for
from drake_disasm.studies.runner import open_study, run_study
from drake_disasm.studies.study import Study
from tests.drake_disasm.studies.test_study import bits, small_precision
from tests.refusals import refused

distributed = pytest.importorskip("distributed")


def _run_here(study: Study, folder: Path, workers: int) -> dict[str, str]:
    open_study(study, folder, resume=False)
    run_study(study, folder, workers)
    return bits(folder)


def _run_on_cluster(study: Study, folder: Path) -> None:
    options = {"processes": False, "threads_per_worker": 1, "dashboard_address": ":0"}
    with distributed.LocalCluster(n_workers=1, **options) as cluster:
        open_study(study, folder, resume=False)
        address = cluster.scheduler_address
        with executor_for("dask", address) as (executor, host):
            run_study(study, folder, 1, executor, host)


def test_a_cluster_changes_no_bit(tmp_path: Path) -> None:
    study = small_precision(lockstep=False, seeds=(0,), levels=("0",))
    alone = _run_here(study, tmp_path / "alone", 1)
    _run_on_cluster(study, tmp_path / "cluster")
    assert bits(tmp_path / "cluster") == alone


@pytest.mark.slow
@pytest.mark.parametrize("lockstep", [True, False])
def test_processes_give_the_same_bits(tmp_path, lockstep):
    study = small_precision(lockstep=lockstep)
    one, four = (_run_here(study, tmp_path / str(n), n) for n in (1, 4))
    assert one == four and len(one) == 12


def test_a_cluster_that_cannot_work_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    def differ(*_: object, **__: object) -> None:
        raise ValueError("Mismatched versions found: numpy")  # as Dask finds it

    def refuses(name: str, scheduler: str, *words: str) -> None:
        with refused(*words), executor_for(name, scheduler):
            pass

    monkeypatch.setattr("drake_disasm.common.cluster._PATIENCE", 0.5)
    refuses("dask", "", "`executor`", "scheduler")
    refuses("local", "x", "`executor`", "scheduler")
    refuses("dask", "tcp://127.0.0.1:9", "127.0.0.1:9", "does not answer")
    with distributed.LocalCluster(n_workers=0, dashboard_address=":0") as cluster:
        refuses("dask", cluster.scheduler_address, "has no workers")
    monkeypatch.setattr(distributed.Client, "get_versions", differ)
    with distributed.LocalCluster(
        n_workers=1, processes=False, dashboard_address=":0"
    ) as cluster:
        refuses("dask", cluster.scheduler_address, "other versions ", "numpy")
