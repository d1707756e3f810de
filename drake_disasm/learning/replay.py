"""Transitions: their layout as rows of one table, and the replay memory."""

from typing import NamedTuple

import numpy as np
from torch import Tensor

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.text import shown
from drake_disasm.mdp import ACTION_NAMES, STATE_NAMES

_STATES, _ACTIONS = len(STATE_NAMES), len(ACTION_NAMES)
#: Numbers in one transition; the last is its weight in a batch.
WIDTH = 2 * _STATES + _ACTIONS + 3
# A row drawn twice is computed once, with twice the weight: the same gradient on fewer
# rows. It pays where matrix products dominate, and costs a search for equal draws.
_MERGED_FROM = 1000  # rows of a batch
_MERGED_OUT_OF = 64  # rows of the memory


class Batch(NamedTuple):
    """Transitions as the updates see them.

    Attributes:
        observation, next_observation: (n, 12) scaled.
        action: (n, 6) in [-1, 1], before imprecision (algorithm 3.2).
        reward: (n,).
        terminated: (n,) 1 where the task itself ended, which cuts the bootstrap;
            0 elsewhere, at a time limit too.
        weight: (n,) adding up to 1.
    """

    observation: Tensor
    action: Tensor
    reward: Tensor
    next_observation: Tensor
    terminated: Tensor
    weight: Tensor


def split(rows: Tensor) -> Batch:
    """Returns the columns of rows (n, WIDTH)."""
    s, a = _STATES, _ACTIONS
    return Batch(
        rows[:, :s],
        rows[:, s : s + a],
        rows[:, s + a],
        rows[:, s + a + 1 : 2 * s + a + 1],
        rows[:, 2 * s + a + 1],
        rows[:, -1] / rows[:, -1].sum(),
    )


class Replay:
    """A ring of transitions, each one row of float32.

    Attributes:
        size: transitions held.

    Args:
        capacity: transitions kept; a new one then replaces the oldest.
    """

    def __init__(self, capacity: int) -> None:
        self._rows = np.zeros((capacity, WIDTH), dtype=np.float32)
        self._next = 0
        self.size = 0

    def add(
        self,
        observation: np.ndarray,
        action: np.ndarray,
        reward: float,
        next_observation: np.ndarray,
        terminated: bool,
    ) -> None:
        """Stores one transition; arguments as in `Batch`, without the first axis."""
        row = self._rows[self._next]
        row[:_STATES] = observation
        row[_STATES : _STATES + _ACTIONS] = action
        row[_STATES + _ACTIONS] = reward
        row[_STATES + _ACTIONS + 1 : -2] = next_observation
        row[-2:] = terminated, 1.0
        self._next = (self._next + 1) % len(self._rows)
        self.size = min(self.size + 1, len(self._rows))

    def sample(self, count: int, generator: np.random.Generator) -> np.ndarray:
        """Returns rows (n, WIDTH) of `count` draws with replacement.

        In large batches equal draws are merged: then n < count, and the weights say
        how often each row was drawn.
        """
        chosen = generator.integers(self.size, size=count)
        if count < _MERGED_FROM or self.size < _MERGED_OUT_OF:
            return self._rows[chosen]
        chosen, times = np.unique(chosen, return_counts=True)
        rows = self._rows[chosen]
        rows[:, -1] = times
        return rows

    def contents(self) -> tuple[np.ndarray, int]:
        """Returns the rows held (size, WIDTH) and where the next one goes."""
        return self._rows[: self.size], self._next

    def restore(self, rows: np.ndarray, following: int) -> None:
        """Restores the result of `contents`.

        Raises:
            DisasmError: the rows don't fit in here.
        """
        if len(rows) > len(self._rows) or rows.shape[1:] != (WIDTH,):
            raise DisasmError(
                f"has a memory of {rows.shape}, which does not fit one of "
                f"{self._rows.shape}; resume with the hyper-parameters that the "
                "training was started with"
            )
        if not 0 <= following < len(self._rows):
            raise DisasmError(
                f"has a memory whose next row is {shown(following)}; delete it to "
                "start anew"
            )
        self.size, self._next = len(rows), following
        self._rows[: self.size] = rows
