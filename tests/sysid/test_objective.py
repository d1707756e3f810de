from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from sysid.identification.linearisation import linearise
from sysid.objective import (
    FAILED_RESIDUAL,
    Objective,
    huber_weights,
    pseudo_residual,
    rms,
)
from sysid.workers import Workers
from tests.sysid.toys import NOISE, Decay

TRUTH = np.array([2.0, 1.5, 0.3])
THETAS = np.array([TRUTH, [1.0, 1.0, 1.0], [2.0, 2.95, 0.3], [0.5, 0.1, 0.0]])


def test_is_equation_4_8_up_to_a_constant():
    """(1/n) ||s'_real - s'_sim||_2 of the weighted channels, times sqrt(n)."""
    model = Decay()
    objective = Objective(model, Workers())
    assert objective(TRUTH[None])[0] == pytest.approx(1.0, abs=0.1)
    n = model.measurements.rows
    for theta in THETAS[[0, 1, 3]]:
        predicted = model.predict(theta, slice(0, n))
        weighted = (model.measurements.values - predicted) / NOISE
        assert objective(theta)[0] == pytest.approx(
            np.linalg.norm(weighted) / n * np.sqrt(n)
        )


def test_a_failed_simulation_is_a_finite_penalty_and_counted():
    objective = Objective(Decay(), Workers())
    values = objective(THETAS)
    assert values[2] == FAILED_RESIDUAL and values[2] > values[[0, 1, 3]].max()
    assert objective.evaluations == 4
    ((theta, reason),) = objective.failures
    assert np.array_equal(theta, THETAS[2]) and "too large to simulate" in reason


def test_a_prediction_that_is_not_finite_is_a_failure_too():
    class Broken(Decay):
        def predict(self, theta, rows):
            return super().predict(theta, rows) * np.nan

    objective = Objective(Broken(), Workers())
    assert objective(TRUTH)[0] == FAILED_RESIDUAL
    assert "not finite" in objective.failures[0][1]


def test_the_same_bits_with_one_worker_and_threads():
    model = Decay()
    expected = Objective(model, Workers())(THETAS)
    with ThreadPoolExecutor(2) as pool, Workers(executor=pool) as threads:
        assert np.array_equal(Objective(model, threads)(THETAS), expected)


def test_pseudo_residuals_square_to_hubers_loss():
    r = np.array([-50.0, -3.0, -1.0, 0.0, 2.0, 3.0, 7.0])
    expected = np.where(np.abs(r) <= 3, r**2, 2 * 3 * np.abs(r) - 9)
    np.testing.assert_allclose(pseudo_residual(r, 3.0) ** 2, expected)
    np.testing.assert_array_equal(np.sign(pseudo_residual(r, 3.0)), np.sign(r))
    np.testing.assert_array_equal(pseudo_residual(r, np.inf), r)
    assert rms(np.array([[3.0, -4.0]])) == pytest.approx(np.sqrt(12.5))
    np.testing.assert_allclose(huber_weights(r, 3.0), [0.06, 1, 1, 1, 1, 1, 3 / 7])


def test_predictions_come_back_in_si():
    model = Decay()
    predicted = Objective(model, Workers()).predictions(TRUTH)
    rows = slice(0, model.measurements.rows)
    np.testing.assert_allclose(predicted, model.predict(TRUTH, rows))


def test_derivatives_may_be_those_of_a_surrogate():
    class Double(Decay):
        def predict(self, theta, rows):
            return 2.0 * super().predict(theta, rows)

    own, surrogate = (
        linearise(
            Objective(Decay(), Workers(), surrogate=a), np.full(3, 0.4), central=False
        )
        for a in (None, Double())
    )
    assert np.array_equal(surrogate.residual, own.residual)
    np.testing.assert_allclose(surrogate.jacobian, 2.0 * own.jacobian, atol=1e-6)
