"""How many simulations a fit takes, where each costs seconds."""

import numpy as np
import pytest

from sysid.identification.gauss_newton import gauss_newton
from sysid.models.base import Array, LogModel
from sysid.models.measurements import Channel, Measurements
from sysid.objective import Objective
from sysid.parameters import Parameter
from sysid.workers import Workers
from tests.sysid.toys import Decay


def test_at_a_minimum_one_step_is_tried_and_no_damped_ones():
    model = Decay()
    objective = Objective(model, Workers())
    found = gauss_newton(objective, objective.start, 20, central=False, min_gain=1e-9)
    before = objective.evaluations
    again = gauss_newton(objective, found.u, start=found, central=False)
    assert objective.evaluations == before + 1
    assert np.array_equal(again.u, found.u)


def test_far_from_it_a_fit_still_arrives():
    model = Decay()
    objective = Objective(model, Workers())
    u = np.array([0.9, 0.02, 0.9])
    found = gauss_newton(objective, u, 30, central=False)
    assert objective.value(found.residual) < 1.1


class _BetweenWalls(LogModel):
    """y = a x + |b| w: whichever way b goes, it makes a contact that is not there."""

    def __init__(self) -> None:
        phase = 2.0 * np.pi * np.arange(40) / 40.0
        x, z = np.sin(phase), np.cos(phase)
        self.x, self.w = x, 0.5 * x + 0.87 * z
        self.parameters = tuple(Parameter(n, 0.0, -5.0, 5.0, "N") for n in "ab")
        channels = [Channel("y", "N", noise=0.01)]
        self.measurements = Measurements.of_array(0.3 * x - z, channels)

    def predict(self, theta: Array, rows: slice) -> Array:
        return (theta[0] * self.x + abs(theta[1]) * self.w)[rows]

    def select_rows(self, mask):
        return self.replace(x=self.x[mask], w=self.w[mask])


def test_where_no_step_of_all_helps_each_parameter_is_tried_alone():
    objective = Objective(_BetweenWalls(), Workers())
    start = objective.start
    found = gauss_newton(objective, start, 6, central=False)
    a, b = objective.scaling.from_unit(found.u)
    np.testing.assert_allclose([a, b], [0.3, 0.0], atol=0.01)


class _OneSteepReading(LogModel):
    """y = a in 39 readings, which are one, and y = 30 a in another, which is zero."""

    def __init__(self) -> None:
        self.x = np.r_[30.0, np.ones(39)]
        self.parameters = (Parameter("a", 0.001, -5.0, 5.0, "N"),)
        channels = [Channel("y", "N", noise=0.01)]
        self.measurements = Measurements.of_array(self.x == 1.0, channels)

    def predict(self, theta: Array, rows: slice) -> Array:
        return (theta[0] * self.x)[rows]

    def select_rows(self, mask):
        return self.replace(x=self.x[mask])


def test_where_one_reading_makes_steps_short_longer_ones_are_tried():
    """An outlier is no more than linear in Huber's loss; its weight says otherwise."""
    objective = Objective(_OneSteepReading(), Workers(), huber_delta=3.0)
    found = gauss_newton(objective, objective.start, 8, central=False)
    assert objective.scaling.from_unit(found.u)[0] == pytest.approx(1.0, abs=0.05)
