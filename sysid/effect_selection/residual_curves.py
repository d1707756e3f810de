"""Empirical dependences of a residual: smooth curves of covariates.

One curve (a cubic and a step) of one covariate in one channel. Where such a curve
explains what no effect of the library does, the ending is "unexplained", and the curve
shows where to look.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.models.base import LogModel

Array = NDArray[np.float64]

_WIDTH = 0.1  # of the largest value: of the step at zero


@dataclass(frozen=True)
class Dependence:
    """A curve of a covariate in a channel.

    Attributes:
        covariate: such as "time" or "velocity".
        channel: whose residual.
        columns: of the curve, among all curves' columns.
    """

    covariate: str
    channel: str
    columns: range

    @property
    def text(self) -> str:
        """The dependence in words."""
        return f"{self.channel} depends on {self.covariate}"


def dependence_curves(model: LogModel) -> tuple[Array, list[Dependence]]:
    """Returns the columns (rows, channels, k) of all curves, and what they are."""
    measured = model.measurements
    columns: list[Array] = []
    dependences = []
    for number, channel in enumerate(measured.channels):
        for name, values in model.covariates(number).items():
            basis = _basis(values)
            begin = len(columns)
            for column in basis.T:
                full = np.zeros((measured.rows, len(measured.channels)))
                full[:, number] = column
                columns.append(full)
            found = range(begin, len(columns))
            dependences.append(Dependence(name, channel.name, found))
    if not columns:
        return np.zeros((measured.rows, len(measured.channels), 0)), []
    return np.stack(columns, axis=2), dependences


def _basis(values: Array) -> Array:
    """Returns a cubic and a step at zero (rows, 4) of a covariate (rows,)."""
    size = max(float(np.abs(values).max()), 1e-300)
    x = values / size
    return np.column_stack([x, x**2, x**3, np.tanh(x / _WIDTH)])
