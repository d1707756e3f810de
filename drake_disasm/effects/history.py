"""What was measured a while ago: the memory of a transport delay."""

import dataclasses

import numpy as np

from drake_disasm.common.arrays import Array, array_like, namespace


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

    def begin(self, value: Array) -> Array:
        """Returns the history (..., numbers) of values (..., size) always there."""
        xp, count = namespace(value), self.samples
        leading = value.shape[:-1]
        ages = array_like(np.linspace(0.0, 2.0 * self.longest, count), value)
        ages = xp.broadcast_to(ages[:, None], (*leading, count, 1))
        values = xp.broadcast_to(value[..., None, :], (*leading, count, self.size))
        return self._flat(xp.concat([ages, values], axis=-1))

    def extended(self, history: Array, value: Array, interval: float) -> Array:
        """Returns the history (..., numbers) with values (..., size) now.

        Args:
            history: (..., numbers) up to the sample before.
            value: now.
            interval: since then [s].
        """
        xp, rows = namespace(history), self._rows(history)
        ages, values = rows[..., :1] + interval, rows[..., 1:]
        rows = xp.concat([ages, values], axis=-1)
        spacing = self.longest / (self.samples - 2)
        apart = ages[..., 1:2, :] - ages[..., :1, :]
        older = xp.concat([rows[..., :1, :], rows[..., :-1, :]], axis=-2)
        rows = xp.where((apart > 0.999 * spacing) & (interval > 0.0), older, rows)
        now = xp.concat([0.0 * value[..., :1], value], axis=-1)[..., None, :]
        return self._flat(xp.concat([now, rows[..., 1:, :]], axis=-2))

    def at(self, history: Array, age: float | Array) -> Array:
        """Returns the values (..., size) of a while [s] ago, at most `longest`.

        Args:
            history: (..., numbers).
            age: a number, or (..., 1).
        """
        xp, rows = namespace(history), self._rows(history)
        ages = rows[..., 0]
        after = xp.sum(xp.astype(ages < age, xp.int64), axis=-1)
        after = xp.clip(after, 1, self.samples - 1)[..., None, None]
        every = xp.broadcast_to(after, (*after.shape[:-1], 1 + self.size))
        new = xp.take_along_axis(rows, every - 1, axis=-2)[..., 0, :]
        old = xp.take_along_axis(rows, every, axis=-2)[..., 0, :]
        share = (age - new[..., :1]) / (old[..., :1] - new[..., :1])
        return new[..., 1:] + share * (old[..., 1:] - new[..., 1:])

    def _rows(self, history: Array) -> Array:
        """Returns (..., samples, 1 + size), each an age and a value."""
        shape = (*history.shape[:-1], self.samples, 1 + self.size)
        return namespace(history).reshape(history, shape)

    def _flat(self, rows: Array) -> Array:
        return namespace(rows).reshape(rows, (*rows.shape[:-2], self.numbers))
