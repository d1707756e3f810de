"""The Ljung-Box test: is a residual white noise?"""

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

Array = NDArray[np.float64]


def autocorrelation(residual: Array, lags: int) -> Array:
    """Returns the autocorrelation (lags,) of a residual (n,) at lags 1 to `lags`."""
    centred = residual - residual.mean()
    power = float(centred @ centred)
    if power == 0.0:
        return np.zeros(lags)
    return np.array([centred[k:] @ centred[:-k] for k in range(1, lags + 1)]) / power


def ljung_box(residual: Array, lags: int = 10) -> float:
    """Returns the p-value of "this residual (n,) is white" (Ljung and Box 1978).

    Q = n (n + 2) sum_k rho_k^2 / (n - k) is chi-squared with `lags` degrees of
    freedom if it is. A small value says that something is left in the residual, not
    what; a large one says that nothing was found.
    """
    n = len(residual)
    lags = min(lags, n // 2)
    if lags < 1:
        return 1.0
    rho = autocorrelation(residual, lags)
    Q = n * (n + 2) * np.sum(rho**2 / (n - np.arange(1, lags + 1)))
    return float(chi2.sf(Q, lags))
