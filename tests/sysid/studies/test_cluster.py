"""A study on a Dask cluster: same bits, workers that die, and what is refused."""

import os
import random
import shutil
import signal
import subprocess
import threading
from collections.abc import Sequence
from pathlib import Path

import pytest

from drake_disasm.common.cluster import executor_for
from sysid.studies.runner import open_study, run_study
from sysid.studies.study import Study
from tests.progress import wait_until
from tests.refusals import refused
from tests.sysid.studies.test_study import bits, small_precision

distributed = pytest.importorskip("distributed")
dask = pytest.importorskip("dask")


def _run_here(study: Study, folder: Path, workers: int) -> dict[str, str]:
    open_study(study, folder, resume=False)
    run_study(study, folder, workers)
    return bits(folder)


def _run_and_kill(study: Study, folder: Path, workers: int, victims: int) -> None:
    """Runs a study on a cluster, of which some workers at random are killed.

    One after the other, once episodes are written.
    """
    killed: list[int] = []
    options = {"processes": victims > 0, "threads_per_worker": 1}  # or this process
    with distributed.LocalCluster(
        n_workers=workers, dashboard_address=":0", **options
    ) as cluster:

        def kill() -> None:
            """Kills them."""
            for worker in random.sample(list(cluster.workers.values()), victims):
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
    assert len(killed) == victims


def test_a_cluster_changes_no_bit(tmp_path: Path) -> None:
    study = small_precision(lockstep=False, seeds=(0,), levels=("0",))
    alone = _run_here(study, tmp_path / "alone", 1)
    _run_and_kill(study, tmp_path / "cluster", 1, 0)
    assert bits(tmp_path / "cluster") == alone


@pytest.mark.slow
def test_one_worker_four_and_a_cluster_of_four_give_the_same_bits(tmp_path):
    study = small_precision(lockstep=False, seeds=(0, 1))
    alone = _run_here(study, tmp_path / "one", 1)
    assert _run_here(study, tmp_path / "four", 4) == alone
    _run_and_kill(study, tmp_path / "cluster", 4, 2)
    assert bits(tmp_path / "cluster") == alone


def _certificate(folder: Path) -> tuple[Path, Path, Path]:
    """Returns an authority's certificate, one that it has signed, and its key."""
    folder.mkdir()
    files = ca, certificate, key = tuple(folder / n for n in ("ca", "cert", "key"))
    curve = "-newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 1"
    for command in (
        f"req -x509 {curve} -subj /CN=authority -keyout ca_key -out {ca}",
        f"req {curve} -subj /CN=dask -keyout {key} -out request",
        f"x509 -req -in request -CA {ca} -CAkey ca_key -CAcreateserial "
        f"-out {certificate}",
    ):
        subprocess.run(
            ["openssl", *command.split()], cwd=folder, check=True, capture_output=True
        )
    return files


@pytest.mark.skipif(not shutil.which("openssl"), reason="no openssl")
def test_a_cluster_with_certificates(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ours, others = _certificate(tmp_path / "ours"), _certificate(tmp_path / "others")
    ca, certificate, key = map(str, ours)
    roles = ("client", "scheduler", "worker")
    files = {f"tls_{r}_cert": certificate for r in roles}
    files |= {f"tls_{r}_key": key for r in roles}
    security = distributed.Security(tls_ca_file=ca, require_encryption=True, **files)
    options = {"n_workers": 1, "processes": False, "dashboard_address": ":0"}
    monkeypatch.setattr("drake_disasm.common.cluster._PATIENCE", 1.0)

    def refuses(scheduler: str, tls: Sequence[Path], *words: str) -> None:
        with refused(*words), executor_for("dask", scheduler, tls):
            pass

    with distributed.LocalCluster(
        protocol="tls://", security=security, **options
    ) as cluster:
        address = cluster.scheduler_address
        with executor_for("dask", address, ours) as (executor, _):
            assert executor.submit(pow, 2, 5).result() == 32
        refuses(address, (), "needs certificates", "`tls` CA CERTIFICATE KEY")
        refuses(address, others, "does not answer", "tls://")
        refuses(address.replace("tls", "tcp"), (), "does not answer", "tls://")
        refuses(address, (*ours[:2], others[2]), "can't be used", "`tls`")
        refuses(address, (ours[0], tmp_path / "no", ours[2]), "no: ", "`tls`")
        refuses("tcp://127.0.0.1:9", ours, "`tls`", "tls://HOST:PORT")
        configured = {"ca-file": ca, "client.cert": certificate, "client.key": key}
        with (
            dask.config.set(
                {f"distributed.comm.tls.{k}": v for k, v in configured.items()}
            ),
            executor_for("dask", address) as (executor, _),
        ):
            assert executor.submit(pow, 2, 6).result() == 64


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
