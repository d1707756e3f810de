"""What the training loop asks of an agent: the built-in ones, or somebody's own."""

from typing import Protocol

import numpy as np

from drake_disasm.common.arrays import Array
from drake_disasm.learning.random_numbers import Random


class Agent(Protocol):
    """A learner from transitions, of s observed numbers and a actions in [-1, 1].

    Arrays are NumPy's, or tensors in a training on a device.

    Attributes:
        updates: calls of `learn`.
    """

    updates: int

    def explore(self, observation: Array, noise: Array, sigma: Array) -> Array:
        """Returns exploring actions (n, a) float32 in [-1, 1].

        Args:
            observation: (n, s) float32, scaled.
            noise: (n, a) float32, standard normal.
            sigma: (n, 1) its standard deviation by the training's schedule.
        """

    def learn(self, rows: Array, generator: Random) -> None:
        """Learns from transitions (n, 2 s + a + 3), which `replay.split` names."""

    def arrays(self) -> dict[str, np.ndarray]:
        """Returns the whole state, for a checkpoint."""

    def restore(self, arrays: dict[str, np.ndarray]) -> None:
        """Restores the result of `arrays`."""
