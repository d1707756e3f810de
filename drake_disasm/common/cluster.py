"""Executors by name: processes of this program, or a Dask cluster."""

import contextlib
import logging
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import read_bytes
from drake_disasm.common.text import clipped

if TYPE_CHECKING:
    from distributed import Client
    from distributed.security import Security

EXECUTORS = ("local", "dask")
_PATIENCE = 10.0  # s until a scheduler must have answered
#: What results depend on, beside what Dask itself compares.
_PACKAGES = ["drake_disasm", "pydrake", "torch"]
_TLS = "tls://"
_TLS_FIELDS = ("tls_ca_file", "tls_client_cert", "tls_client_key")
_LARGEST = 1_000_000  # of a certificate [bytes]
_CERTIFICATES = (
    "give `tls` CA CERTIFICATE KEY, or set distributed.comm.tls in Dask's configuration"
)


@contextlib.contextmanager
def executor_for(
    name: str, scheduler: str, tls: Sequence[Path] = ()
) -> Iterator[tuple[Executor | None, str]]:
    """Gives an executor, and the name under which its workers reach this program.

    Args:
        name: one of EXECUTORS; "local" gives None: `WorkerPool` has its own processes.
        scheduler: address of Dask's, as tcp://HOST:PORT, or tls://HOST:PORT.
        tls: PEM files of the certificates' authority, of this program's certificate
            and of its key; without them Dask's configuration has them.

    Raises:
        DisasmError: Dask is not installed, certificates are missing or wrong, the
            scheduler does not answer, it has no workers, or they have other versions
            of what the work needs.
    """
    if tls and not scheduler.startswith(_TLS):
        raise DisasmError("`tls`: is for a `scheduler` tls://HOST:PORT; give both")
    if name == "local":
        if scheduler:
            raise DisasmError(
                f"`scheduler` {scheduler}: is for `executor` dask; give both"
            )
        yield None, ""
        return
    if not scheduler:
        raise DisasmError(
            "`executor` dask: give the address of its `scheduler`, tcp://HOST:8786"
        )
    with contextlib.ExitStack() as stack:
        stack.enter_context(_silent())
        client = stack.enter_context(_client(scheduler, tls))
        yield stack.enter_context(client.get_executor()), _own_name(scheduler)


@contextlib.contextmanager
def _silent() -> Iterator[None]:
    """Keeps Dask from writing its own tracebacks beside our errors."""
    logger = logging.getLogger("distributed")
    level = logger.level
    logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        logger.setLevel(level)


@contextlib.contextmanager
def _client(scheduler: str, tls: Sequence[Path]) -> Iterator["Client"]:
    """Gives a client of a scheduler that answers, and closes it."""
    try:
        import distributed
    except ImportError:
        raise DisasmError(
            "`executor` dask: Dask is not installed; "
            "pip install 'drake_disasm[cluster]'"
        ) from None
    security = _security(scheduler, tls) if scheduler.startswith(_TLS) else None
    try:
        client = distributed.Client(scheduler, timeout=_PATIENCE, security=security)
    except (OSError, ValueError, TypeError) as error:
        raise DisasmError(
            f"scheduler {scheduler}: does not answer within {_PATIENCE:g} s "
            f"({clipped(str(error))}); start one by `dask scheduler`, or check the "
            "address, which begins with tls:// if it has certificates, and these"
        ) from None
    try:
        _check_workers(client, scheduler)
        yield client
    finally:
        client.close()


def _security(scheduler: str, tls: Sequence[Path]) -> "Security":
    """Returns the certificates by which to reach a scheduler; refuses what is wrong."""
    from distributed.security import Security

    files = dict(zip(_TLS_FIELDS, map(str, tls), strict=False))
    security = Security(require_encryption=True, **files)
    fields = [getattr(security, field) for field in _TLS_FIELDS]
    if not all(fields[:2]):  # a certificate's file may hold the key, too
        raise DisasmError(f"scheduler {scheduler}: needs certificates; {_CERTIFICATES}")
    for field in fields:
        if field and "\n" not in field:  # else it is the content itself
            read_bytes(Path(field), _CERTIFICATES, _LARGEST)
    try:
        security.get_connection_args("client")
    except (OSError, ValueError) as error:
        raise DisasmError(
            f"scheduler {scheduler}: a certificate, or its key, can't be used "
            f"({clipped(str(error))}); {_CERTIFICATES}"
        ) from None
    return security


def _check_workers(client: "Client", scheduler: str) -> None:
    """Refuses a cluster without workers, or with other versions than here."""
    if not client.scheduler_info(n_workers=-1)["workers"]:
        raise DisasmError(
            f"scheduler {scheduler}: has no workers; start some by "
            f"`dask worker {scheduler}`"
        )
    try:
        client.get_versions(check=True, packages=_PACKAGES)
    except ValueError as error:
        raise DisasmError(
            f"scheduler {scheduler}: its workers have other versions than this "
            f"program ({clipped(str(error))}); install the same everywhere"
        ) from None


def _own_name(scheduler: str) -> str:
    """Returns the address of this machine that a scheduler's machine can reach."""
    from distributed.comm import get_address_host, resolve_address
    from distributed.utils import get_ip

    return str(get_ip(get_address_host(resolve_address(scheduler))))
