"""Do two searches agree, and what it means if they do not."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from sysid import confidence
from sysid.identification.uncertainty import Uncertainty

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Agreement:
    """Whether two methods found the same optimum.

    Attributes:
        agree: in the objective and in the parameters.
        objective_gap: difference of the objectives over that at the edge of the joint
            95 % confidence region; below 1 they are equally good.
        parameter_gap: (p,) differences in standard deviations.
        distance: Mahalanobis distance over that of the region's edge; below 1 each is
            within the region of the other.
        text: what it means.
    """

    agree: bool
    objective_gap: float
    parameter_gap: Array
    distance: float
    text: str


def compare_methods(
    names: tuple[str, str],
    points: tuple[Array, Array],
    values: tuple[float, float],
    residuals: int,
    spread: Uncertainty,
    parameters: Sequence[str],
) -> Agreement:
    """Compares two optima.

    The region is that of the likelihood: n (f1^2 - f2^2) / f2^2 <= chi2(0.95, p),
    stretched by how much wider the bootstrap's region is than the curvature's, for
    residuals that are not independent or not identically distributed.

    Args:
        names: of the methods.
        points: (p,) each, in the unit box.
        values: of the objective.
        residuals: how many numbers the objective is the rms of.
        spread: uncertainty at the better one.
        parameters: their names.
    """
    size = len(points[0])
    edge = float(chi2.ppf(confidence.LEVEL, size))
    C = spread.bootstrap_covariance
    stretch = max(1.0, float(np.trace(C @ np.linalg.pinv(spread.curvature))) / size)
    low, high = sorted(values)
    gap = residuals * (high**2 - low**2) / max(low**2, 1e-300) / edge / stretch
    difference = points[0] - points[1]
    squared = float(difference @ np.linalg.pinv(C, hermitian=True) @ difference)
    distance = float(np.sqrt(squared / edge))
    sigma = np.sqrt(np.maximum(np.diagonal(C), 1e-300))
    same_value, same_point = gap <= 1.0, distance <= 1.0
    if not same_value:
        text = _text_of_stuck(names, values)
    elif not same_point:
        text = _text_of_ambiguity(names, parameters, difference / sigma)
    else:
        text = (
            f"{names[0]} and {names[1]} agree: the same objective ({values[0]:.4f} and "
            f"{values[1]:.4f}) and the same parameters within their uncertainty."
        )
    return Agreement(
        same_value and same_point, float(gap), difference / sigma, distance, text
    )


def _text_of_stuck(names: tuple[str, str], values: tuple[float, float]) -> str:
    worse, better = names if values[0] >= values[1] else names[::-1]
    return (
        f"{worse} is stuck: it ended at {max(values):.4f}, {better} at "
        f"{min(values):.4f}, which is more than noise explains. Take {better}'s "
        "values; a larger `budget` or narrower bounds help the other."
    )


def _text_of_ambiguity(
    names: tuple[str, str], parameters: Sequence[str], gap: Array
) -> str:
    """Returns which parameters differ, the most first, and what to do."""
    order = [i for i in np.argsort(-np.abs(gap)) if abs(gap[i]) > 2.0][:3]
    listed = ", ".join(f"{parameters[i]} by {abs(gap[i]):.0f}" for i in order)
    return (
        f"{names[0]} and {names[1]} reach the same objective with different parameters "
        f"(in standard deviations: {listed or 'all together'}): the log determines "
        "these less precisely than the intervals state. Take the distance between the "
        "two as the uncertainty, freeze one, or record motions that separate them."
    )
