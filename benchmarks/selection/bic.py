"""Forward least squares by the Bayesian information criterion (Schwarz 1978).

At each step the option that lowers the criterion most is added, as long as contiguous
blocks are predicted better with it by fits to all others. All that is added is
confirmed; options within ten of the best are its ambiguous set ("very strong" evidence
begins there, Kass and Raftery 1995).
"""

import numpy as np

from selection.answer import Answer, Case
from selection.columns import Columns, Option, columns_of, gain_of, without_base
from selection.inference import ambiguous, intervals

_VERY_STRONG = 10.0


def select(case: Case) -> Answer:
    """Returns what forward least squares says of a case."""
    columns = Columns.of(case)
    steps: list[tuple[Option, tuple[Option, ...]]] = []
    while len(steps) < len(columns.options):
        chosen = columns_of([option for option, _ in steps])
        best, rivals = _best(columns, chosen)
        if best is None or not _predicts(columns, chosen, best):
            break
        steps.append((best, rivals))
    options = [option for option, _ in steps]
    return columns.answer(
        "explained" if steps else "none",
        options,
        [name for option in options for name in option.names],
        ambiguous(steps),
        intervals(columns, options),
    )


def _best(
    columns: Columns, chosen: list[int]
) -> tuple[Option | None, tuple[Option, ...]]:
    """Returns the option that lowers the criterion most, and its rivals."""
    y, B, X = columns.scaled(columns.weight(chosen))
    base, size = np.hstack([B, X[:, chosen]]), np.linalg.norm(X, axis=0)
    left, residual = without_base(X, base), without_base(y[:, None], base)[:, 0]
    change = []
    for option in columns.options:
        own = option.columns
        gain = 0.0
        if not set(own) <= set(chosen):
            gain = min(gain_of(left[:, own], residual, size[own]), 1.0 - 1e-12)
        change.append(len(y) * np.log(1.0 - gain) + len(own) * np.log(len(y)))
    if not change or min(change) >= 0.0:
        return None, ()
    best = columns.options[int(np.argmin(change))]
    near = [
        o
        for o, c in zip(columns.options, change, strict=True)
        if c <= min(change) + _VERY_STRONG and o is not best
    ]
    return best, tuple(near)


def _predicts(columns: Columns, chosen: list[int], option: Option) -> bool:
    """Returns whether an option lowers the error of blocks that were not fitted."""
    weight = columns.weight(chosen)
    longer = list(dict.fromkeys([*chosen, *(int(c) for c in option.columns)]))
    without, with_it = (
        float(np.sum(columns.held_out_residual(own, weight) ** 2))
        for own in (chosen, longer)
    )
    return with_it < without
