"""Measurements: how residuals are weighed."""

import dataclasses

import numpy as np
import pytest

from sysid.models.measurements import Channel, Measurements


@pytest.mark.parametrize("model_error", [None, np.array([[0.0], [4.0]])])
def test_residuals_are_in_units_of_the_noise_and_of_the_models_own_error(model_error):
    channels = (Channel("fx", "N", 3.0, "stated"),)
    values = np.array([[1.0], [1.0]])
    measured = Measurements(values, channels, np.zeros(2, dtype=np.int64), ("log",))
    measured = dataclasses.replace(measured, model_error=model_error)
    residual = measured.weighted(values + 15.0)
    expected = [[5.0], [5.0]] if model_error is None else [[5.0], [3.0]]
    np.testing.assert_allclose(residual, expected)
    np.testing.assert_allclose(measured.predicted(residual), values + 15.0)
