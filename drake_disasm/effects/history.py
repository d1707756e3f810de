"""What was measured a while ago: the memory of a transport delay."""

import dataclasses

import numpy as np


@dataclasses.dataclass(frozen=True)
class History:
    """Samples of a vector with their ages, newest first, in one flat array.

    A fixed number of samples reaches back for the longest delay, however fast they
    come: what follows the sample before by less than the least spacing is forgotten
    as soon as a newer one is there. In between values are interpolated linearly.

    Attributes:
        size: of the vector.
        samples: that are kept.
        longest: delay that it has to reach back for [s].
    """

    size: int
    samples: int
    longest: float

    @property
    def numbers(self) -> int:
        """Length of the array."""
        return self.samples * (1 + self.size)

    def begin(self, value: np.ndarray) -> np.ndarray:
        """Returns the history (numbers,) of a value (size,) that was always there."""
        ages = np.linspace(0.0, 2.0 * self.longest, self.samples)
        return np.column_stack([ages, np.tile(value, (self.samples, 1))]).reshape(-1)

    def extended(
        self, history: np.ndarray, value: np.ndarray, interval: float
    ) -> np.ndarray:
        """Returns the history (numbers,) with a value (size,) that is there now.

        Args:
            history: (numbers,) up to the sample before.
            value: now.
            interval: since then [s].
        """
        rows = history.reshape(self.samples, -1).copy()
        rows[:, 0] += interval
        spacing = self.longest / (self.samples - 2)
        if interval > 0.0 and rows[1, 0] - rows[0, 0] > 0.999 * spacing:
            rows[1:] = rows[:-1].copy()
        rows[0, 0], rows[0, 1:] = 0.0, value
        return np.asarray(rows.reshape(-1))

    def at(self, history: np.ndarray, age: float) -> np.ndarray:
        """Returns the value (size,) of a while [s] ago, at most `longest`."""
        rows = history.reshape(self.samples, -1)
        ages = rows[:, 0]
        i = int(np.clip(np.searchsorted(ages, age), 1, self.samples - 1))
        share = (age - ages[i - 1]) / (ages[i] - ages[i - 1])
        return np.asarray(rows[i - 1, 1:] + share * (rows[i, 1:] - rows[i - 1, 1:]))
