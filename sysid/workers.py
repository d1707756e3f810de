"""Models evaluated in parallel."""

import hashlib
import pickle
import threading
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np

from drake_disasm.common.executors import WorkerPool
from drake_disasm.common.progress import Progress, ignore_progress
from sysid.models.base import Array, LogModel, PredictionError

#: What a worker has built, by thread: a diagram serves one thread.
_mine = threading.local()


class Workers(WorkerPool):
    """Workers that evaluate models, and keep what they built for it.

    A model travels with its work, pickled once. Each worker keeps its copies of the
    last ones, so that a diagram is built once per worker, and again where a worker
    was replaced.
    """

    def __init__(
        self,
        count: int = 1,
        *,
        executor: Executor | None = None,
        progress: Progress = ignore_progress,
    ) -> None:
        """Starts nothing yet.

        Args:
            count: processes; with 1 the work is done in this process.
            executor: does the work instead; whoever made it shuts it down.
            progress: called in this process after each simulation; may raise to stop.
        """
        super().__init__(
            count, executor=executor, progress=progress, stage="simulating"
        )

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
        if self.in_this_process or model.affine:  # a product of matrices: not worth it
            return [self.counted(_outcome(model, theta, rows)) for theta, rows in work]
        payload = pickle.dumps(model)
        key = hashlib.sha256(payload).hexdigest()
        return self.map(_simulate, [_Piece(key, payload, *piece) for piece in work])


@dataclass(frozen=True)
class _Piece:
    """A model's simulation of some rows, as it is sent to a worker.

    Attributes:
        key: the payload's hash.
        payload: the model, pickled.
        theta: parameters (p,).
        rows: of its log.
    """

    key: str
    payload: bytes
    theta: Array
    rows: slice


def _simulate(piece: _Piece) -> Array | str:
    """Returns what this worker's copy of a model simulates."""
    return _outcome(_model(piece.key, piece.payload), piece.theta, piece.rows)


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
