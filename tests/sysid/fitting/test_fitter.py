"""Fits of a model that begins where its own parameters say."""

from typing import Self

import numpy as np
from numpy.typing import NDArray

from sysid.fitting.fit import Fit
from sysid.fitting.fitter import Fitter
from sysid.fitting.settings import DEFAULT_SETTINGS
from sysid.identification.linearisation import linearise
from sysid.models.base import Array, LogModel
from sysid.models.measurements import Channel, Measurements
from sysid.parameters import Parameter
from sysid.workers import Workers


class _Begun(LogModel):
    """y = a + k b, where b is what a was taken for as the model began."""

    def __init__(self, measured: Array, reaction: float) -> None:
        self.parameters = (Parameter("a", 0.0, -5.0, 5.0, "N"),)
        channels = [Channel("y", "N", noise=0.01)]
        self.measurements = Measurements.of_array(measured, channels)
        self.reaction, self.taken = reaction, 0.0

    def predict(self, theta: Array, rows: slice) -> Array:
        value = float(theta[0]) + self.reaction * self.taken
        return np.full(len(self.measurements.values[rows]), value)

    def select_rows(self, mask: NDArray[np.bool_]) -> Self:
        return self.replace()

    def with_begins(self, theta: Array | None) -> Self:
        taken = self.taken if theta is None else float(theta[0])
        if abs(taken - self.taken) < 1e-6:
            return self
        return self.replace(taken=taken)


def _fitted(reaction: float, measured: float) -> tuple[Fitter, Fit]:
    random = np.random.default_rng(1)
    model = _Begun(random.normal(measured, 0.01, 50), reaction)
    fitter = Fitter.of(model, Workers(), np.inf, DEFAULT_SETTINGS)
    return fitter, fitter.fit(())


def test_what_a_model_does_not_react_to_is_one_fit():
    _, fit = _fitted(0.0, 1.0)
    np.testing.assert_allclose(fit.theta, 1.0, atol=0.01)


def test_where_the_begin_overshoots_the_way_is_halved():
    """Taken in full, each way would be 1.5 times as far as the last, and back."""
    _, fit = _fitted(1.5, 1.0)
    np.testing.assert_allclose(fit.theta, 0.4, atol=0.06)


def test_residuals_of_a_fit_are_those_of_its_model():
    """Derivatives by effects that it lacks are differences from them."""
    fitter, fit = _fitted(1.5, 1.0)
    objective = fitter.objective(fit.model)
    [residual] = objective.residuals(fit.theta)
    np.testing.assert_array_equal(fit.linearisation.residual, residual)
    assert fit.objective == objective.value(residual)


class _Counted(LogModel):
    """y = sum of squares of twenty parameters; counts the predictions of all."""

    predictions = 0
    costly = True

    def __init__(self) -> None:
        self.parameters = tuple(
            Parameter(f"a{i}", 0.5, -1.0, 1.0, "N") for i in range(20)
        )
        channels = [Channel("y", "N", noise=0.01)]
        self.measurements = Measurements.of_array(np.ones(5), channels)

    def predict(self, theta: Array, rows: slice) -> Array:
        _Counted.predictions += 1
        return np.full(5, float(theta @ theta))[rows]

    def select_rows(self, mask: NDArray[np.bool_]) -> Self:
        return self


def test_derivatives_that_a_run_has_found_are_there_for_the_next(tmp_path):
    fitter = Fitter.of(
        _Counted(), Workers(), np.inf, DEFAULT_SETTINGS, tmp_path / "fits"
    )
    objective = fitter.objective(fitter.base)
    known = linearise(objective, objective.start).of_first(0)
    _Counted.predictions = 0
    begun = fitter.extended(known, objective, objective.start, deadline=0.0)
    made, columns = _Counted.predictions, begun.jacobian.shape[-1]
    assert made > 0 and columns < 20
    whole = fitter.extended(known, objective, objective.start, deadline=np.inf)
    rest = -(-20 // columns) - 1  # parts, each of which may ask for the origin, too
    assert _Counted.predictions - made <= 20 - columns + rest
    again = fitter.extended(known, objective, objective.start, deadline=np.inf)
    assert _Counted.predictions - made <= 20 - columns + rest
    np.testing.assert_array_equal(again.jacobian, whole.jacobian)
    np.testing.assert_array_equal(begun.jacobian, whole.jacobian[..., :columns])
    np.testing.assert_allclose(whole.jacobian[0, 0], 100.0 * 2.0, rtol=0.01)
