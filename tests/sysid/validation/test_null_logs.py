"""Noise that is drawn for logs in which nothing is missing."""

import numpy as np
import pytest

from sysid.identification.whiteness import autocorrelation
from sysid.validation.null_logs import autoregressive, sieve


def test_a_sieve_draws_noise_that_is_as_slow_and_as_correlated_as_a_residual():
    random, shape = np.random.default_rng(0), np.zeros((4000, 1))
    slow = [autoregressive(rho)(random, shape)[:, 0] for rho in (0.9, 0.9)]
    residual = np.column_stack([3.0 * slow[0], slow[0] + slow[1]])
    drawn = sieve(residual)(np.random.default_rng(1), np.zeros((8000, 2)))
    assert np.std(drawn, axis=0) == pytest.approx([1.0, 1.0], abs=0.15)
    for own, new in zip(residual.T, drawn.T, strict=True):
        np.testing.assert_allclose(
            autocorrelation(new, 5), autocorrelation(own, 5), atol=0.08
        )
    wanted = np.corrcoef(residual.T)[0, 1]
    assert np.corrcoef(drawn.T)[0, 1] == pytest.approx(wanted, abs=0.1)
