"""What every identification works on: a model that predicts a log's channels."""

import abc
import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from drake_disasm.common.errors import DisasmError
from drake_disasm.logs import Episode, Log
from drake_disasm.scenario import Scenario, with_values
from sysid.parameters import Parameter, by_name, by_path

Array = NDArray[np.float64]


class PredictionError(Exception):
    """A model can't be evaluated at these parameters: the simulation failed."""


@dataclasses.dataclass(frozen=True)
class Channel:
    """One measured quantity.

    Attributes:
        name: such as "fx".
        unit: SI unit.
        noise: standard deviation of the measurement; residuals are divided by it.
        origin: where that number is from, for the report.
    """

    name: str
    unit: str
    noise: float
    origin: str


@dataclasses.dataclass(frozen=True)
class Measurements:
    """What was measured, in the rows and channels that a model predicts.

    Attributes:
        values: (rows, channels).
        channels: what the columns are.
        episode: (rows,) number of the episode that each row is of, from 0.
        names: of the episodes.
    """

    values: Array
    channels: tuple[Channel, ...]
    episode: NDArray[np.int64]
    names: tuple[str, ...]

    @classmethod
    def of_logs(
        cls,
        logs: Sequence[Log],
        channels: tuple[Channel, ...],
        values: Callable[[Log, Episode], Array],
    ) -> Self:
        """Returns what logs measured, all episodes of all of them.

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
            tuple(f"{log.folder.name}/{episode.name}" for log, episode in episodes),
        )

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(self.values)

    @property
    def noise(self) -> Array:
        """Standard deviation of each channel (channels,)."""
        return np.array([channel.noise for channel in self.channels])

    def select(self, mask: NDArray[np.bool_]) -> Self:
        """Returns the rows where the mask (rows,) is true, episodes numbered anew."""
        kept, episode = np.unique(self.episode[mask], return_inverse=True)
        return dataclasses.replace(
            self,
            values=self.values[mask],
            episode=episode,
            names=tuple(self.names[i] for i in kept),
        )

    def with_noise(self, noise: Array, origin: str) -> Self:
        """Returns the same with other standard deviations (channels,)."""
        channels = tuple(
            dataclasses.replace(channel, noise=float(value), origin=origin)
            for channel, value in zip(self.channels, noise, strict=True)
        )
        return dataclasses.replace(self, channels=channels)


class LogModel(abc.ABC):
    """Predicts a log's measured channels under parameters.

    A model goes through pickle to the workers that evaluate it; what it builds
    there, such as a diagram, it builds once and keeps out of the pickle.

    Attributes:
        parameters: what can be varied, in the order of theta.
        measurements: what it is compared with.
        affine: whether predictions are affine in theta, so that least squares
            have one exact solution.
    """

    parameters: tuple[Parameter, ...]
    measurements: Measurements
    affine: bool = False

    @property
    def costly(self) -> bool:
        """Whether an evaluation takes seconds: a search is to ask for few rows."""
        return False

    def surrogate(self) -> Self:
        """Returns a model that behaves alike and is faster; itself if there is none.

        Its parameters are the same. Differences of its predictions serve where those
        of this one take too long.
        """
        return self

    @property
    def noise_groups(self) -> tuple[str, ...]:
        """For each channel a label; channels of one label have one unknown noise."""
        return tuple(channel.name for channel in self.measurements.channels)

    @abc.abstractmethod
    def predict(self, theta: Array, rows: slice) -> Array:
        """Returns the channels (len(rows), channels) that the model says.

        Args:
            theta: (p,) values of `parameters`.
            rows: one of `chunks`.

        Raises:
            PredictionError: the simulation failed.
        """

    def simulate(self, theta: Array, rows: slice) -> Array:
        """Returns what a prediction takes long for, (len(rows), k).

        Parameters that `simulated` leaves out do not change it: many predictions
        may share one.

        Raises:
            PredictionError: the simulation failed.
        """
        return self.predict(theta, rows)

    def read(self, theta: Array, rows: slice, simulated: Array) -> Array:
        """Returns the prediction that follows from what `simulate` gave."""
        return simulated

    def predictions(self, theta: Array) -> Array:
        """Returns what the model says of all rows, (rows, channels), in this process.

        Raises:
            PredictionError: the simulation failed.
        """
        parts = [self.simulate(theta, rows) for rows in self.chunks()]
        return self.read(theta, slice(0, self.measurements.rows), np.concatenate(parts))

    @property
    def simulated(self) -> NDArray[np.bool_]:
        """Which parameters (p,) `simulate` depends on."""
        return np.ones(len(self.parameters), dtype=bool)

    @abc.abstractmethod
    def freeze(self, values: Mapping[str, float]) -> Self:
        """Returns the same model with some parameters fixed at values, by name."""

    @abc.abstractmethod
    def _selected(self, mask: NDArray[np.bool_]) -> Self:
        """Returns the same model of the rows where the mask (rows,) is true."""

    def chunks(self) -> list[slice]:
        """Returns the pieces of work that one evaluation falls into."""
        return [slice(0, self.measurements.rows)]

    def of_episodes(self, episodes: Sequence[int]) -> Self:
        """Returns the same model of some of the episodes.

        Raises:
            DisasmError: they have no row.
        """
        mask = np.isin(self.measurements.episode, episodes)
        if not mask.any():
            raise DisasmError("no episode is left to fit; hold out fewer")
        return self._selected(mask)

    def of_rows(self, mask: NDArray[np.bool_]) -> Self:
        """Returns the same model of the rows where the mask (rows,) is true."""
        return self._selected(mask)

    def with_measurements(self, measurements: Measurements) -> Self:
        """Returns the same model compared with other measurements of the same rows."""
        return self._changed(measurements=measurements)

    def thin(self, every: int) -> Self:
        """Returns the same model of every n-th row, where rows stand alone."""
        return self

    def describe(self, theta: Array) -> dict[str, tuple[float, str]]:
        """Returns quantities that people ask for, with units, by name; none here."""
        return {}

    def covariates(self, channel: int) -> dict[str, Array]:
        """Returns what a channel's residual might depend on, (rows,) each, by name."""
        return {}

    def _changed(self, **attributes: Any) -> Self:
        """Returns a copy with other attributes, without what it has built."""
        changed = type(self).__new__(type(self))
        changed.__dict__.update(dict(self.__getstate__()) | attributes)
        return changed

    def __getstate__(self) -> dict[str, Any]:
        """Returns what goes through pickle; a model that builds leaves that out."""
        return self.__dict__


class ScenarioModel(LogModel):
    """A model whose parameters are numbers of a scenario.

    Attributes:
        scenario: at the parameters' nominal values.
    """

    scenario: Scenario

    def freeze(self, values: Mapping[str, float]) -> Self:
        """See LogModel."""
        return self._changed(
            scenario=with_values(self.scenario, by_path(self.parameters, values)),
            parameters=tuple(p for p in self.parameters if p.name not in values),
        )

    def extended(self, scenario: Scenario, parameters: Sequence[Parameter]) -> Self:
        """Returns the same model in another scenario, with more parameters of it."""
        return self._changed(
            scenario=scenario, parameters=(*self.parameters, *parameters)
        )

    def scenario_at(self, theta: Array) -> Scenario:
        """Returns the scenario with the parameters' values (p,) in it."""
        values = by_name(self.parameters, theta)
        return with_values(self.scenario, by_path(self.parameters, values))


def even_chunks(rows: int, size: int) -> list[slice]:
    """Returns slices of at most `size` rows that cover all of them."""
    return [slice(i, min(i + size, rows)) for i in range(0, rows, size)]
