"""By what factor a log's velocities and accelerations are off the derivatives."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid

from sysid.models.channel_grams import Estimate, blocks_of, jackknife_error

Array = NDArray[np.float64]

#: rad or m that half of an arm's joints never reach: three turns.
MOST_TURN = 20.0
#: Off 1 by less is a filter or a clock, and of no consequence.
_LEAST_FACTOR = 0.01
_UNITS = {
    "degrees": 180.0 / np.pi,
    "turns a minute": 30.0 / np.pi,
    "turns": 0.5 / np.pi,
    "thousandths": 1000.0,
}


def median_reach(q: Array) -> float:
    """Returns how far from zero half of the joints' positions (n, joints) go."""
    return float(np.median(np.abs(q).max(axis=0)))


def rate_factors(
    time: Array, episode: NDArray[np.int64], values: Array, rates: Array
) -> list[Estimate]:
    """Returns by what factor each joint's rate is off the derivative of its values.

    From the integral of the rate over whole blocks and over whole episodes, less an
    offset and a slope; the nearer to one counts: a filter rounds what is fast only. The
    factor is NaN at a joint that does not move.

    Args:
        time: (n,) [s].
        episode: (n,) number of each row's episode.
        values, rates: (n, joints).
    """
    by_block, whole = [], []
    for number in np.unique(episode):
        rows = np.flatnonzero(episode == number)
        block = blocks_of(len(rows))
        for k in range(int(block[-1]) + 1):
            own = rows[block == k]
            if len(own) > 3:
                by_block.append(_products(time[own], values[own], rates[own]))
        whole.append(_products(time[rows], values[rows], rates[rows]))
    if not by_block:
        return [Estimate(np.nan, np.nan)] * values.shape[1]
    blocks, total = np.array(by_block), np.sum(whole, axis=0)  # (blocks, 3, joints)
    return [_ratio(blocks[:, :, i], total[:, i]) for i in range(values.shape[1])]


def _products(time: Array, values: Array, rates: Array) -> Array:
    """Returns sums (3, joints) of values squared, times integral, and of integral's."""
    integral = cumulative_trapezoid(rates, time, axis=0, initial=0)
    line = np.column_stack([np.ones(len(time)), time - time[0]])
    both = np.hstack([integral, values])
    left = both - line @ np.linalg.lstsq(line, both, rcond=None)[0]
    integral, values = np.hsplit(left, 2)
    products = values**2, integral * values, integral**2
    return np.array([product.sum(axis=0) for product in products])


def _ratio(products: Array, whole: Array) -> Estimate:
    """Returns the factor with its error, by sums over blocks (blocks, 3) and (3,)."""
    total = products.sum(axis=0)
    if not total[1]:
        return Estimate(np.nan, np.nan)
    others = [total - part for part in products]
    ratios = [_nearest_to_one(other) for other in others if other[1]]
    error = jackknife_error(ratios) if len(ratios) > 1 else np.inf
    return Estimate(_nearest_to_one(total, whole), error)


def _nearest_to_one(*products: Array) -> float:
    """Returns the factor nearest to one that noise allows, by sums (3,).

    Noise of the values lowers their regression's slope, that of the rates the slope of
    the other one: the factor is between the two.
    """
    slopes = [each[1:] / each[:-1] for each in products]
    return float(np.clip(1.0, np.min(slopes), np.max(slopes)))


def right_rates(
    time: Array, episode: NDArray[np.int64], values: Array, rates: Array
) -> tuple[Array, Array]:
    """Returns rates (n, joints) as they should be, and the factors taken out (joints,).

    Args:
        time, episode, values, rates: see `rate_factors`.
    """
    estimates = rate_factors(time, episode, values, rates)
    factors = np.array([e.value if is_factor(e) else 1.0 for e in estimates])
    return rates / factors, factors


def is_factor(factor: Estimate) -> bool:
    """Returns whether a factor is known, and known to be another than one."""
    return factor.is_off(0.0) and factor.is_off(1.0, _LEAST_FACTOR)


def rate_text(rate: str, joints: Sequence[str], factors: Array) -> str:
    """Returns what rates are, as a clause.

    Args:
        rate: its column, `v` or `vd`.
        joints: names.
        factors: (joints,) that the rates are off by; 1 for right ones.
    """
    of = {"v": "q", "vd": "v"}[rate]
    parts = [
        f"{factor:.3g} times at {joint}{_unit_text(factor)}"
        for joint, factor in zip(joints, factors, strict=True)
        if factor != 1.0
    ]
    return f"{rate} is not the derivative of {of}, but {', '.join(parts)}"


def _unit_text(factor: float) -> str:
    """Returns which unit a factor is that of, in words; empty if of none."""
    if abs(factor + 1.0) < _LEAST_FACTOR:
        return " (the other sign)"
    for unit, size in _UNITS.items():
        if abs(factor / size - 1.0) < _LEAST_FACTOR:
            return f" (as in {unit})"
    return ""
