"""Whether an effect explains more than a noise that is stated can.

Blocks can't speak for what shows in a few rows alone: a force that is read too large
where the bolt meets the end of the groove, once in an episode. Where the noise is
stated, the size of the change can.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from sysid.fitting.fit import Fit

Array = NDArray[np.float64]


def exceeds_noise_p(before: Fit, after: Fit, parameters: int) -> float:
    """Returns the p-value that noise alone makes a fit with more parameters so good.

    The length of the residuals before, along the change, is a chi-squared variable by
    chance. It is shortened by what the model's own error could amount to, were it in
    each row of `model_error_reach` standard deviations and of the sign that the change
    has; and divided by what the rows that change are left with, row by row or block by
    block, where that is more than the stated noise.

    Args:
        before, after: fits to the same rows without and with the parameters.
        parameters: how many the second has more.
    """
    left = after.bounded_residual
    change = before.bounded_residual - left
    length = float(np.linalg.norm(change))
    if not length:
        return 1.0
    along = change / length
    share = after.model.measurements.model_error_share
    off = after.settings.model_error_reach * float(np.sum(np.abs(along) * share))
    score = max(float(np.sum(along * (left + change))) - off, 0.0)
    of_blocks = np.bincount(after.blocks, np.sum(along * left, axis=1))
    remaining = max(float(np.sum((along * left) ** 2)), float(np.sum(of_blocks**2)))
    return float(chi2.sf(score**2 / max(1.0, remaining), parameters))
