"""Derivatives by differences: over which step."""

import numpy as np
import pytest

from sysid.identification.linearisation import linearise
from sysid.models.base import Array, LogModel
from sysid.models.measurements import Channel, Measurements
from sysid.objective import Objective
from sysid.parameters import Parameter
from sysid.workers import Workers


class _InSteps(LogModel):
    """y = a in whole steps of a tenth: less of it shows nothing."""

    def __init__(self, first_step: float | None) -> None:
        self.parameters = (Parameter("a", 0.0, 0.0, 10.0, "N", first_step=first_step),)
        channels = [Channel("y", "N", noise=0.01)]
        self.measurements = Measurements.of_array(np.ones(20), channels)

    def predict(self, theta: Array, rows: slice) -> Array:
        return np.full(20, np.floor(10.0 * theta[0] + 1e-9) / 10.0)[rows]

    def select_rows(self, mask):
        return self


@pytest.mark.parametrize("first_step", [None, 0.5])
def test_a_parameter_may_say_over_which_step_it_shows(first_step):
    objective = Objective(_InSteps(first_step), Workers())
    for central in (True, False):
        found = linearise(objective, objective.start, central=central)
        shown = float(found.jacobian[0, 0, 0]) * 0.01 / 10.0  # N of y per N of a
        assert shown == pytest.approx(0.0 if first_step is None else 1.0)
