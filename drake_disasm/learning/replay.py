"""Transitions: their layout as rows of one table, and the replay memory."""

from typing import NamedTuple

import array_api_compat
import numpy as np
import torch
from torch import Tensor

from drake_disasm.common.arrays import Array, array_like, namespace, to_numpy
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.text import shown
from drake_disasm.learning.random_numbers import Random
from drake_disasm.mdp import ACTION_NAMES, STATE_NAMES

#: Numbers that the task's agents see and choose.
STATES, ACTIONS = len(STATE_NAMES), len(ACTION_NAMES)
#: Numbers in one transition of the task; the last is its weight in a batch.
WIDTH = 2 * STATES + ACTIONS + 3
# A row drawn twice is computed once, with twice the weight: the same gradient on fewer
# rows. It pays where matrix products dominate, and costs a search for equal draws.
_MERGED_FROM = 1000  # rows of a batch
_MERGED_OUT_OF = 64  # rows of the memory


class Batch(NamedTuple):
    """Transitions as the updates see them.

    Attributes:
        observation, next_observation: (n, s) scaled.
        action: (n, a) in [-1, 1], before imprecision (algorithm 3.2).
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


def split(rows: Tensor, states: int = STATES) -> Batch:
    """Returns the columns of rows (n, 2 s + a + 3), of s observed numbers."""
    s, a = states, rows.shape[1] - 2 * states - 3
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
        width: numbers in each.

    Args:
        capacity: transitions kept; a new one then replaces the oldest.
        states, actions: how many numbers are observed and chosen.
        device: "numpy", or where tensors are.
    """

    def __init__(
        self,
        capacity: int,
        states: int = STATES,
        actions: int = ACTIONS,
        device: str = "numpy",
    ) -> None:
        self._states, self.width = states, 2 * states + actions + 3
        shape = capacity, self.width
        self._rows: Array = np.zeros(shape, np.float32)
        if device != "numpy":
            self._rows = torch.zeros(shape, device=device)
        self._next = 0
        self.size = 0

    def add(
        self,
        observation: Array,
        action: Array,
        reward: Array,
        next_observation: Array,
        terminated: Array,
        which: Array | slice = slice(None),
    ) -> None:
        """Stores transitions; arguments as in `Batch`.

        Args:
            observation, action, reward, next_observation, terminated: of each.
            which: (n,) mask of those that are stored.
        """
        s, capacity = self._states, len(self._rows)
        xp, device = namespace(self._rows), array_api_compat.device(self._rows)
        shape = len(observation), self.width
        rows = xp.empty(shape, dtype=xp.float32, device=device)
        rows[:, :s], rows[:, -s - 2 : -2] = observation, next_observation
        rows[:, s : -s - 3], rows[:, -s - 3] = action, reward
        rows[:, -2], rows[:, -1] = terminated, 1.0
        rows = rows[which][-capacity:]
        places = xp.arange(len(rows), device=device)
        self._rows[(places + self._next) % capacity] = rows
        self._next = (self._next + len(rows)) % capacity
        self.size = min(self.size + len(rows), capacity)

    def sample(self, count: int, generator: Random) -> Array:
        """Returns rows (n, width) of `count` draws with replacement.

        In large batches of NumPy equal draws are merged: then n < count, and the
        weights say how often each row was drawn.
        """
        chosen = generator.integers(self.size, size=count)
        is_few = count < _MERGED_FROM or self.size < _MERGED_OUT_OF
        if is_few or not isinstance(chosen, np.ndarray):
            return self._rows[chosen]
        chosen, times = np.unique(chosen, return_counts=True)
        rows = self._rows[chosen]
        rows[:, -1] = times
        return rows

    def contents(self) -> tuple[np.ndarray, int]:
        """Returns the rows held (size, width) and where the next one goes."""
        return to_numpy(self._rows[: self.size]), self._next

    def restore(self, rows: np.ndarray, following: int) -> None:
        """Restores the result of `contents`.

        Raises:
            DisasmError: the rows don't fit in here.
        """
        if len(rows) > len(self._rows) or rows.shape[1:] != (self.width,):
            raise DisasmError(
                f"has a memory of {rows.shape}, which does not fit one of "
                f"{tuple(self._rows.shape)}; resume with the hyper-parameters that the "
                "training was started with"
            )
        if not 0 <= following < len(self._rows):
            raise DisasmError(
                f"has a memory whose next row is {shown(following)}; delete it to "
                "start anew"
            )
        self.size, self._next = len(rows), following
        self._rows[: self.size] = array_like(rows, self._rows)
