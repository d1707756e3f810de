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


def lengths_and_errors(change: Array, own_error: Array) -> tuple[Array, Array]:
    """Returns the length of a change, and what of it may be the model's own error.

    (1 + k,) each: in all channels, and in each of the k that change. The error is as
    large as stated in each row, and of the sign that the change has.

    Args:
        change: (rows, channels) of residuals.
        own_error: (rows, channels) of the model, in the same units.
    """
    squares = np.sum(change**2, axis=0)
    along = np.sum(np.abs(change) * own_error, axis=0)
    changed = squares > 0.0
    squares, along = (np.append(x.sum(), x[changed]) for x in (squares, along))
    lengths = np.sqrt(squares)
    return lengths, along / np.maximum(lengths, 1e-300)


def exceeds_noise_p(before: Fit, after: Fit, parameters: int) -> float:
    """Returns the p-value that noise alone makes a fit with more parameters so good.

    In all channels together, or in the one in which that is least likely, times how
    many are asked (Bonferroni): what the model's own error may be in those that an
    effect hardly changes says nothing of the one that it does.

    Args:
        before, after: fits to the same rows without and with the parameters.
        parameters: how many the second has more.
    """
    left = after.bounded_residual
    change = before.bounded_residual - left
    changed = np.flatnonzero(change.any(axis=0))
    sets = [changed, *changed[:, None]] if len(changed) > 1 else [changed]
    scores = [_score(change, left, after, each) for each in sets]
    return min(1.0, len(sets) * float(chi2.sf(max(scores), parameters)))


def _score(
    change: Array, left: Array, after: Fit, channels: NDArray[np.int64]
) -> float:
    """Returns a chi-squared variable, if noise is all there is in some channels.

    The length of the residuals before, along the change, is one by chance. It is
    shortened by what the model's own error could amount to, were it in each row of
    `model_error_reach` standard deviations and of the sign that the change has; and
    divided by what the rows that change are left with, row by row or block by block,
    where that is more than the stated noise.

    Args:
        change: (rows, channels) of residuals.
        left: what they are after it.
        after: the fit that leaves them.
        channels: that are asked.
    """
    change, left = change[:, channels], left[:, channels]
    length = float(np.linalg.norm(change))
    if not length:
        return 0.0
    along = change / length
    share = after.model.measurements.model_error_share[:, channels]
    off = after.settings.model_error_reach * float(np.sum(np.abs(along) * share))
    score = max(float(np.sum(along * (left + change))) - off, 0.0)
    of_blocks = np.bincount(after.blocks, np.sum(along * left, axis=1))
    remaining = max(float(np.sum((along * left) ** 2)), float(np.sum(of_blocks**2)))
    return score**2 / max(1.0, remaining)
