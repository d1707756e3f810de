"""Work in parallel through any executor; a pool whose workers die is made anew."""

import hashlib
import multiprocessing
import os
import pickle
import signal
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from types import TracebackType
from typing import Self, TypeVar

import numpy as np

from drake_disasm.common.errors import DisasmError
from sysid.models.base import Array, LogModel, PredictionError

_ATTEMPTS = 3

Job = TypeVar("Job")
Result = TypeVar("Result")

#: What a worker has built, by thread: a diagram serves one thread.
_mine = threading.local()


class Workers:
    """Evaluates models on an executor's workers, kept alive between evaluations.

    Any `concurrent.futures.Executor` will do, Dask's on a cluster too. A model
    travels with its work, pickled once, and each worker keeps what it built of the
    last ones, so that a diagram is built once per worker, and again where a worker
    was replaced.

    Attributes:
        notes: what a report should say, such as workers that died.
    """

    def __init__(
        self,
        count: int = 1,
        make: Callable[[], Executor] | None = None,
        beat: Callable[[], object] | None = None,
    ) -> None:
        """Starts nothing yet.

        Args:
            count: processes; 1 works in this one.
            make: makes the executor, instead of a spawned pool of `count` processes.
            beat: called in this process after each piece of work; may raise to stop.
        """
        self._beat = beat
        self._make = make or (None if count == 1 else lambda: _spawned(count))
        self._executor: Executor | None = None
        self.notes: list[str] = []

    def simulate(
        self, model: LogModel, work: Sequence[tuple[Array, slice]]
    ) -> list[Array | str]:
        """Returns simulations, or why there is none, in the order of the work.

        Args:
            model: simulates.
            work: parameters (p,) and rows of each piece.

        Raises:
            DisasmError: workers died again and again.
        """
        if self._make is None or model.affine:  # a product of matrices: not worth it
            return [self._done(_outcome(model, theta, rows)) for theta, rows in work]
        payload = pickle.dumps(model)
        key = hashlib.sha256(payload).hexdigest()
        return self._tenaciously(
            lambda executor: [
                executor.submit(_simulate, key, payload, theta, rows)
                for theta, rows in work
            ]
        )

    def map(
        self, function: Callable[[Job], Result], jobs: Sequence[Job]
    ) -> list[Result]:
        """Returns what a function makes of each job, in their order.

        Args:
            function: of a module, so that it can be sent to a process.
            jobs: each sent to a worker.

        Raises:
            DisasmError: workers died again and again.
        """
        if self._make is None:
            return [self._done(function(job)) for job in jobs]
        return self._tenaciously(
            lambda executor: [executor.submit(function, job) for job in jobs]
        )

    def close(self) -> None:
        """Ends the workers; the next work starts new ones."""
        if self._executor:
            self._executor.shutdown(wait=False, cancel_futures=True)
        self._executor = None

    def _done(self, result: Result) -> Result:
        if self._beat:
            self._beat()
        return result

    def _tenaciously(
        self, submit: Callable[[Executor], list[Future[Result]]]
    ) -> list[Result]:
        """Returns the results of what is submitted, again if workers die over it."""
        assert self._make is not None
        for _ in range(_ATTEMPTS):
            try:
                if self._executor is None:
                    self._executor = self._make()
                futures = submit(self._executor)
                return [self._done(future.result()) for future in futures]
            except BrokenExecutor:
                self.notes.append("a worker process died; its work was done again")
                self.close()
        raise DisasmError(
            f"worker processes died {_ATTEMPTS} times over the same work (out of "
            "memory?); give fewer --workers, then resume"
        )

    def __enter__(self) -> Self:
        """Returns the workers."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Ends the workers."""
        self.close()


def _spawned(count: int) -> Executor:
    """Returns a pool of fresh interpreters: Drake's threads do not survive a fork."""
    context = multiprocessing.get_context("spawn")
    return ProcessPoolExecutor(count, context, _begin_worker)


def _begin_worker() -> None:
    """Leaves Ctrl-C to the parent, and the world with it, should it be killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_leave_with_parent, daemon=True).start()


def _leave_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _simulate(key: str, payload: bytes, theta: Array, rows: slice) -> Array | str:
    """Returns what this worker's copy of a model simulates."""
    return _outcome(_model(key, payload), theta, rows)


def _outcome(model: LogModel, theta: Array, rows: slice) -> Array | str:
    """Returns what the model simulates for the rows, or why it can't."""
    try:
        simulated = model.simulate(theta, rows)
    except PredictionError as error:
        return str(error)
    if not np.isfinite(simulated).all():
        return "the prediction is not finite"
    return simulated


def _model(key: str, payload: bytes) -> LogModel:
    """Returns this thread's copy of a model, with all that it has built."""
    models: dict[str, LogModel] = _mine.__dict__.setdefault("models", {})
    if key not in models:
        while len(models) >= 2:  # the whole and the held-out rows, say
            del models[next(iter(models))]
        models[key] = pickle.loads(payload)
    return models[key]
