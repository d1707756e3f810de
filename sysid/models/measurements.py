"""What was measured: rows of channels, each with its noise, of one or more episodes."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Self

import numpy as np
from numpy.typing import NDArray

from drake_disasm.common.errors import DisasmError
from drake_disasm.logs import Episode, Log

Array = NDArray[np.float64]

_MOST_STEPS, _JITTER = 0.9, 0.1  # so many steps differ by no more from the median


@dataclasses.dataclass(frozen=True)
class Channel:
    """One measured quantity.

    Attributes:
        name: such as "fx".
        unit: SI unit.
        noise: standard deviation of the measurement; residuals are divided by it.
            NaN if it is not known: it is then estimated from a first fit.
        origin: where that number is from, for the report.
    """

    name: str
    unit: str
    noise: float = np.nan
    origin: str = "given"


@dataclasses.dataclass(frozen=True)
class Measurements:
    """What was measured, in the rows and channels that a model predicts.

    Attributes:
        values: (rows, channels).
        channels: what the columns are.
        episode: (rows,) number of the episode that each row belongs to, from 0.
        names: of the episodes.
        period: of the rows' sampling [s]; None if they are not equally spaced.
        model_error: (rows, channels) standard deviation of what the model itself is
            known to be off by, SI; None: nothing is known.

    Raises:
        DisasmError: the shapes do not match.
    """

    values: Array
    channels: tuple[Channel, ...]
    episode: NDArray[np.int64]
    names: tuple[str, ...]
    period: float | None = None
    model_error: Array | None = None

    def __post_init__(self) -> None:
        """Refuses arrays whose shapes do not match."""
        if self.values.ndim != 2 or self.values.shape[1] != len(self.channels):
            raise DisasmError(
                f"measurements: values have the shape {self.values.shape}; give "
                f"(rows, {len(self.channels)}), one column for each channel"
            )
        if self.episode.shape != self.values.shape[:1]:
            raise DisasmError(
                f"measurements: episode has the shape {self.episode.shape}; give one "
                f"number for each of the {len(self.values)} rows"
            )

    @classmethod
    def of_array(
        cls, values: Array, channels: Sequence[Channel], name: str = "log"
    ) -> Self:
        """Returns one episode.

        Args:
            values: (rows, channels), or (rows,) of a single channel, SI.
            channels: what the columns are.
            name: of the episode.

        Raises:
            DisasmError: values and channels do not match.
        """
        table = np.asarray(values, dtype=float)
        table = table[:, None] if table.ndim == 1 else table
        episode = np.zeros(len(table), dtype=np.int64)
        return cls(table, tuple(channels), episode, (name,))

    @classmethod
    def of_logs(
        cls,
        logs: Sequence[Log],
        channels: tuple[Channel, ...],
        values: Callable[[Log, Episode], Array],
    ) -> Self:
        """Returns all episodes of some logs.

        Args:
            logs: in their order.
            channels: what the columns are.
            values: of one episode, (rows, channels).
        """
        episodes = [(log, episode) for log in logs for episode in log.episodes]
        parts = [values(log, episode) for log, episode in episodes]
        return cls(
            np.concatenate(parts),
            channels,
            np.repeat(np.arange(len(parts)), [len(part) for part in parts]),
            tuple(episode_names(logs)),
            _period([e["time"] for _, e in episodes if "time" in e]),
        )

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(self.values)

    @property
    def noise(self) -> Array:
        """Standard deviation of each channel (channels,)."""
        return np.array([channel.noise for channel in self.channels])

    @property
    def sigma(self) -> Array:
        """Standard deviations that residuals are divided by: noise and model error.

        (channels,), or (rows, channels) where the model's own error is known.
        """
        if self.model_error is None:
            return self.noise
        return np.hypot(self.noise, self.model_error)

    @property
    def model_error_share(self) -> Array:
        """Share of `sigma` (rows, channels) that is the model's own error, or zeros."""
        if self.model_error is None:
            return np.zeros_like(self.values)
        return np.asarray(self.model_error / self.sigma)

    def weighted(self, predicted: Array) -> Array:
        """Returns residuals (rows, channels) of a prediction, in units of `sigma`."""
        return np.asarray((predicted - self.values) / self.sigma)

    def predicted(self, residual: Array) -> Array:
        """Returns the prediction (rows, channels), SI, that residuals belong to."""
        return np.asarray(self.values + residual * self.sigma)

    def select(self, mask: NDArray[np.bool_]) -> Self:
        """Returns the rows where the mask (rows,) is true, episodes renumbered."""
        kept, episode = np.unique(self.episode[mask], return_inverse=True)
        steps = np.diff(np.flatnonzero(mask)) if self.period else np.zeros(0)
        step = np.median(steps) if len(steps) else 1.0
        error = self.model_error
        return dataclasses.replace(
            self,
            period=float(self.period * step) if self.period else None,
            values=self.values[mask],
            episode=episode,
            names=tuple(self.names[i] for i in kept),
            model_error=None if error is None else error[mask],
        )

    def with_values(self, values: Array) -> Self:
        """Returns the same channels with other measured values (rows, channels)."""
        return dataclasses.replace(self, values=values)

    def with_noise(self, noise: Array, origin: str) -> Self:
        """Returns the same with other standard deviations (channels,)."""
        channels = tuple(
            dataclasses.replace(channel, noise=float(value), origin=origin)
            for channel, value in zip(self.channels, noise, strict=True)
        )
        return dataclasses.replace(self, channels=channels)


def episode_names(logs: Sequence[Log]) -> list[str]:
    """Returns the name of each episode of some logs, such as `log/episode_0003`."""
    return [f"{log.folder.name}/{e.name}" for log in logs for e in log.episodes]


def rows_of_logs(
    logs: Sequence[Log], rows: Mapping[str, NDArray[np.int64]]
) -> list[Log]:
    """Returns logs of some rows, without episodes that have none.

    Args:
        logs: in their order.
        rows: numbers of the rows of each episode's table, by the episode's name; those
            of an episode that is not named are all kept.
    """
    found = []
    for log in logs:
        names = episode_names([log])
        kept = [
            e.select(rows[name]) if name in rows else e
            for name, e in zip(names, log.episodes, strict=True)
        ]
        kept = [episode for episode in kept if episode.rows]
        if kept:
            found.append(dataclasses.replace(log, episodes=tuple(kept)))
    return found


def _period(times: Sequence[Array]) -> float | None:
    """Returns the period [s] of times (n,) of some episodes; None if it varies."""
    steps = np.concatenate([np.diff(t) for t in times]) if times else np.zeros(0)
    if not len(steps):
        return None
    period = float(np.median(steps))
    spread = float(np.quantile(np.abs(steps - period), _MOST_STEPS))
    return period if period > 0.0 and spread <= _JITTER * period else None
