"""The sketch: least squares, a test that allows for correlation, and replication.

At each step the option that lowers the loss most is taken; of those within 10 % of its
gain the one with the fewest columns, the others are its ambiguous set. It has to be
more than chance, by a Wald test whose variance allows for correlation (the equal-
weighted cosine estimator of Lazarus, Lewis, Stock and Watson, 2018). It is confirmed if
each of four contiguous quarters is predicted better with it, by 1 %, by a fit to the
other three; else it is suggested.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np
from scipy import stats

from selection.answer import Answer, Case
from selection.columns import (
    Columns,
    Option,
    columns_of,
    gain_of,
    solved,
    without_base,
)
from selection.inference import ambiguous, covariance_of, intervals

_ALPHA = 0.05  # family-wise, over all options
_NEAR = 0.9  # of the best gain: as good an explanation
_QUARTERS, _BETTER = 4, 0.01


@dataclasses.dataclass(frozen=True)
class Step:
    """An option that was added, with its rivals; confirmed, or only suggested."""

    option: Option
    rivals: tuple[Option, ...]
    is_confirmed: bool


def select(case: Case) -> Answer:
    """Returns what the sketch says of a case."""
    columns, steps = Columns.of(case), list[Step]()
    while len(steps) < len(columns.options):
        chosen = columns_of([step.option for step in steps])
        best, rivals = best_option(columns, chosen)
        if best is None or not _is_more_than_chance(columns, chosen, best):
            break
        steps.append(Step(best, rivals, _repeats(columns, chosen, best)))
    options = [step.option for step in steps]
    names = [n for s in steps if s.is_confirmed for n in s.option.names]
    return columns.answer(
        "explained" if steps else "none",
        options,
        names,
        ambiguous([(s.option, s.rivals) for s in steps]),
        intervals(columns, options),
    )


def best_option(
    columns: Columns, chosen: Sequence[int]
) -> tuple[Option | None, tuple[Option, ...]]:
    """Returns the next option, and others that explain as much.

    Args:
        columns: of the log.
        chosen: columns that are in the model.
    """
    weight = columns.weight(chosen)
    y, B, X = columns.scaled(weight)
    base = np.hstack([B, X[:, list(chosen)]])
    left, size = without_base(X, base), np.linalg.norm(X, axis=0)
    residual = without_base(y[:, None], base)[:, 0]
    gains = [
        0.0
        if set(o.columns) <= set(chosen)
        else gain_of(left[:, o.columns], residual, size[o.columns])
        for o in columns.options
    ]
    most = max(gains, default=0.0)
    if most <= 0.0:
        return None, ()
    near = [o for o, g in zip(columns.options, gains, strict=True) if g >= _NEAR * most]
    best = min(near, key=lambda o: (len(o.columns), -gains[columns.options.index(o)]))
    return best, tuple(o for o in near if o is not best)


def _is_more_than_chance(
    columns: Columns, chosen: Sequence[int], option: Option
) -> bool:
    """Returns whether a Wald test over all options rejects that it is null."""
    weight = columns.weight([*chosen, *option.columns])
    y, B, X = columns.scaled(weight)
    base, size = np.hstack([B, X[:, list(chosen)]]), np.linalg.norm(X, axis=0)
    own = without_base(X[:, option.columns], base)
    own = own[:, np.linalg.norm(own, axis=0) > 1e-5 * size[option.columns]]
    residual = without_base(y[:, None], np.hstack([base, own]))[:, 0]
    found = solved(own, without_base(y[:, None], base)[:, 0])
    covariance, nu = covariance_of(columns, own, residual)
    k = own.shape[1]
    if not k or nu < k:
        return False
    wald = float(found @ np.linalg.pinv(covariance, hermitian=True) @ found)
    p = stats.f.sf(wald * (nu - k + 1) / (nu * k), k, nu - k + 1)
    return bool(p * len(columns.options) < _ALPHA)


def _repeats(columns: Columns, chosen: Sequence[int], option: Option) -> bool:
    """Returns whether each quarter is predicted better with it, by the other three."""
    weight = columns.weight(chosen)
    y, B, X = columns.scaled(weight)
    without = np.hstack([B, X[:, list(chosen)]])
    quarter = np.repeat(columns.blocks(_QUARTERS), len(weight))
    for number in range(_QUARTERS):
        own, losses = quarter == number, []
        for A in (without, np.hstack([without, X[:, option.columns]])):
            error = y[own] - A[own] @ solved(A[~own], y[~own])
            losses.append(float(error @ error))
        if losses[1] > (1.0 - _BETTER) * losses[0]:
            return False
    return True
