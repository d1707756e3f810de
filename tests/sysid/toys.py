"""Small models with known answers, for tests of whatever works on any model."""

from collections.abc import Mapping, Sequence
from typing import Any, Self

import numpy as np

from sysid.models import Channel, LogModel, Measurements, PredictionError
from sysid.models.base import even_chunks
from sysid.parameters import Parameter

NOISE = 0.1


class Decay(LogModel):
    """y = a exp(-b x) + c, a log of `episodes` runs over x in 0 ... 3.

    `idle` is a parameter that nothing depends on; `twin_of_a` adds to a.
    """

    def __init__(
        self,
        names: Sequence[str] = ("a", "b", "c"),
        rows: int = 60,
        episodes: int = 4,
        seed: int = 0,
        noise: float = NOISE,
    ) -> None:
        self.parameters = tuple(Parameter(n, 0.5, 0.0, 3.0) for n in names)
        self.names = tuple(names)
        self.others: dict[str, float] = {"a": 2.0, "b": 1.5, "c": 0.3}
        self.x = np.tile(np.linspace(0.0, 3.0, rows), episodes)
        error = noise * np.random.default_rng(seed).normal(size=self.x.size)
        truth = self._curve({"a": 2.0, "b": 1.5, "c": 0.3})
        self.measurements = Measurements(
            (truth + error)[:, None],
            (Channel("y", "N", noise or 1.0, "given"),),
            np.repeat(np.arange(episodes), rows),
            tuple(f"log/episode_{i:04d}" for i in range(episodes)),
        )

    def _curve(self, values: Mapping[str, float], rows: Any = slice(None)) -> Any:
        get = {"twin_of_a": 0.0, **values}
        x = self.x[rows]
        return (get["a"] + get["twin_of_a"]) * np.exp(-get["b"] * x) + get["c"]

    def predict(self, theta, rows):
        values = self.others | dict(zip(self.names, theta, strict=True))
        if values["b"] > 2.9:
            raise PredictionError("b is too large to simulate")
        return self._curve(values, rows)[:, None]

    def chunks(self):
        return even_chunks(self.measurements.rows, 16)

    def select_rows(self, mask) -> Self:
        return self.replace(x=self.x[mask])
