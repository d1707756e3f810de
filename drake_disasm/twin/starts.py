"""The next episode of each environment, settled before it is needed."""

from collections.abc import Sequence

import numpy as np

from drake_disasm.twin.batch import BatchedTwin
from drake_disasm.twin.episodes import Episodes
from drake_disasm.twin.stacking import put_rows, rows_of


class NextEpisodes:
    """Keeps a beginning for each environment, and makes those that are used anew.

    To settle one bolt takes almost as long as to settle all. So as soon as one
    environment's next episode is not there, those of all others that have used
    theirs are made along with it.

    Args:
        twin: whose episodes.
        generators: of each environment, from which its seeds are drawn.
    """

    def __init__(
        self, twin: BatchedTwin, generators: Sequence[np.random.Generator]
    ) -> None:
        self._twin, self._generators = twin, generators
        self._is_ready = np.zeros(twin.count, bool)
        self._seeds = np.zeros(twin.count, np.int64)
        self._episodes: Episodes | None = None

    def take(self, rows: np.ndarray) -> tuple[list[int], Episodes]:
        """Returns seeds and episodes of some environments, by number (m,)."""
        if not self._is_ready[rows].all() or self._episodes is None:
            self._make()
        assert self._episodes is not None
        self._is_ready[rows] = False
        return [int(seed) for seed in self._seeds[rows]], rows_of(self._episodes, rows)

    def _make(self) -> None:
        missing = np.flatnonzero(~self._is_ready)
        for row in missing:
            self._seeds[row] = self._generators[int(row)].integers(2**31)
        made = self._twin.begin(missing, [int(s) for s in self._seeds[missing]])
        if self._episodes is None:
            self._episodes = made
        else:
            put_rows(self._episodes, missing, made)
        self._is_ready[missing] = True
