"""Carries progress from running jobs to the process that waits for them.

A socket does it, not a queue of `multiprocessing`, so that the workers can belong to
any executor: threads, processes, or machines of a cluster.
"""

import contextlib
import secrets
import threading
from collections.abc import Iterator
from concurrent.futures import CancelledError
from dataclasses import dataclass
from multiprocessing import AuthenticationError
from multiprocessing.connection import Client, Connection, Listener
from queue import SimpleQueue
from typing import Any, Self

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.progress import Progress, ProgressUpdate

_BACKLOG = 64  # workers that connect at the same moment


@dataclass(frozen=True)
class Link:
    """How a job reaches the process that waits for it; goes through pickle.

    Attributes:
        address: a Unix socket's path, or host and port.
        key: proves to either side that the other may talk to it.
        job: number of the job.
    """

    address: Any
    key: bytes
    job: int

    @contextlib.contextmanager
    def connected(self) -> Iterator[Progress]:
        """Yields what takes the job's progress.

        It returns once the update has arrived, and raises KeyboardInterrupt if the
        job is to stop or nobody waits for it any more. That ends the job as a
        CancelledError.

        Raises:
            DisasmError: nobody can be reached at the address.
        """
        connection = self._connect()
        with connection:
            try:
                _stop_if_told(connection)
                yield lambda update: self._send(connection, update)
            except KeyboardInterrupt:
                raise CancelledError from None

    def _connect(self) -> Connection:
        try:
            return Client(self.address, authkey=self.key)
        except (OSError, EOFError, AuthenticationError) as error:
            raise DisasmError(
                f"worker cannot report progress to {self.address} ({error}); give the "
                "host name under which workers reach the main process"
            ) from error

    def _send(self, connection: Connection, update: ProgressUpdate) -> None:
        try:
            connection.send((self.job, update))
        except OSError:
            raise KeyboardInterrupt from None
        _stop_if_told(connection)


def _stop_if_told(connection: Connection) -> None:
    try:
        stop = connection.recv()
    except (OSError, EOFError):
        stop = True  # nobody waits any more
    if stop:
        raise KeyboardInterrupt


class ProgressServer:
    """Takes the updates of running jobs, and answers each with whether to stop.

    Attributes:
        events: gets the number of the job and its update.
    """

    def __init__(self, host: str = "") -> None:
        """Listens.

        Args:
            host: name under which workers on other machines reach this one; "" for
                workers on this machine alone.

        Raises:
            DisasmError: this machine does not have that name.
        """
        self.events: SimpleQueue[Any] = SimpleQueue()
        self._key = secrets.token_bytes(32)
        self._stop = threading.Event()
        try:
            address = (host, 0) if host else None
            self._listener = Listener(address, backlog=_BACKLOG, authkey=self._key)
        except OSError as error:
            raise DisasmError(
                f"host {host}: cannot listen there ({error}); give a name of this "
                "machine that its workers know"
            ) from error
        threading.Thread(target=self._accept, daemon=True).start()

    def link(self, job: int) -> Link:
        """Returns what connects a job, by its number, with this."""
        return Link(self._listener.address, self._key, job)

    def stop_jobs(self) -> None:
        """Stops each job at its next update, or before it begins."""
        self._stop.set()

    def __enter__(self) -> Self:
        """Returns the server."""
        return self

    def __exit__(self, *_: object) -> None:
        """Stops jobs that still run, and listens no more."""
        self.stop_jobs()
        with contextlib.suppress(OSError, EOFError, AuthenticationError):
            Client(self._listener.address, authkey=self._key).close()  # wakes _accept
        self._listener.close()

    def _accept(self) -> None:
        while True:
            try:
                connection = self._listener.accept()
            except (AuthenticationError, EOFError, ConnectionError):
                continue  # a worker that died meanwhile, or a stranger
            except OSError:
                return  # closed
            threading.Thread(
                target=self._serve, args=(connection,), daemon=True
            ).start()

    def _serve(self, connection: Connection) -> None:
        """Answers one job until it ends."""
        with connection, contextlib.suppress(OSError, EOFError):
            while True:
                connection.send(self._stop.is_set())
                self.events.put(connection.recv())
