"""Models evaluated in parallel."""

import hashlib
import pickle
import threading
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

from drake_disasm.common.executors import WorkerPool
from drake_disasm.common.progress import Progress, ignore_progress
from sysid.models.base import Array, LogModel, even_chunks

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
        self, model: LogModel, thetas: Array, chunks: Sequence[slice]
    ) -> list[list[Array | str]]:
        """Returns simulations of parameter sets, or why there is none.

        For each of the sets (k, p) a list, of its parts in the order of the chunks.

        Args:
            model: simulates.
            thetas: (k, p).
            chunks: rows of each part.

        Raises:
            DisasmError: workers died again and again.
        """
        # Not by the number of workers: no bit depends on who shared the work.
        groups = [thetas[part] for part in even_chunks(len(thetas), model.together)]
        work = [(group, rows) for group in groups for rows in chunks]
        done = iter(self._simulated(model, work))
        found: list[list[Array | str]] = []
        for _ in groups:
            parts = [next(done) for _ in chunks]
            found += [list(own) for own in zip(*parts, strict=True)]
        return found

    def _simulated(
        self, model: LogModel, work: Sequence[tuple[Array, slice]]
    ) -> list[list[Array | str]]:
        """Returns what `simulate_all` gives of each piece of work."""
        if self.in_this_process or model.affine:  # a product of matrices: not worth it
            return [self.counted(model.simulate_all(*piece)) for piece in work]
        payload = pickle.dumps(model)
        key = hashlib.sha256(payload).hexdigest()
        return self.map(_simulate, [_Piece(key, payload, *piece) for piece in work])


@dataclass(frozen=True)
class _Piece:
    """Simulations of some rows, as they are sent to a worker.

    Attributes:
        key: the payload's hash.
        payload: the model, pickled.
        thetas: parameters (k, p).
        rows: of its log.
    """

    key: str
    payload: bytes
    thetas: Array
    rows: slice


def _simulate(piece: _Piece) -> list[Array | str]:
    """Returns what this worker's copy of a model simulates."""
    model = _model(piece.key, piece.payload)
    return model.simulate_all(piece.thetas, piece.rows)


def _model(key: str, payload: bytes) -> LogModel:
    """Returns this thread's copy of a model, with all that it has built."""
    models: dict[str, LogModel] = _mine.__dict__.setdefault("models", {})
    if key not in models:
        while len(models) >= 2:  # the whole and the held-out rows, say
            del models[next(iter(models))]
        models[key] = pickle.loads(payload)
    return models[key]
