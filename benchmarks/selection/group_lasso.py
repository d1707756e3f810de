"""Group lasso with cross-validation by contiguous blocks (Yuan and Lin 2006).

Groups are effects in one shape, at one joint. The penalty is the largest whose held-out
error is within a standard error of the least (Breiman et al. 1984); all groups that are
not null are confirmed, their sizes by least squares. The solver is that of `skglm`,
which is no dependency of the package: pip install skglm
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_disasm.common.errors import DisasmError
from selection.answer import Answer, Case
from selection.columns import FOLDS, Array, Columns, Option, without_base
from selection.inference import intervals

_PENALTIES = np.geomspace(1.0, 1e-3, 30)  # of the least that leaves nothing
_LEAST = 1e-5  # of a column, that the model's own parameters can't take up


def select(case: Case) -> Answer:
    """Returns what the group lasso says of a case."""
    columns = Columns.of(case)
    y, B, X = columns.scaled(columns.weight([]))
    size = np.linalg.norm(X, axis=0)
    own, target = without_base(X, B), without_base(y[:, None], B)[:, 0]
    shown = np.linalg.norm(own, axis=0) > _LEAST * size
    options = [o for o in columns.options if len(o.candidates) == 1]
    options = [o for o in options if shown[o.columns].all()]
    if not options:
        return columns.answer("none", [], [], {}, {})
    which = np.concatenate([o.columns for o in options])
    A = own[:, which] / np.linalg.norm(own[:, which], axis=0) * np.sqrt(len(y))
    penalty = _by_cross_validation(A, target, options, columns)
    [found] = _path(A, target, options, [penalty])
    kept = [o for o, c in zip(options, _groups(found, options), strict=True) if c.any()]
    return columns.answer(
        "explained" if kept else "none",
        kept,
        [name for option in kept for name in option.names],
        {},
        intervals(columns, kept),
    )


def _by_cross_validation(
    A: Array, y: Array, options: list[Option], columns: Columns
) -> float:
    """Returns the penalty, by contiguous blocks and the rule of one standard error."""
    most = max(
        float(np.linalg.norm(own) / np.sqrt(len(own)))
        for own in _groups(A.T @ y / len(y), options)
    )
    penalties = list(most * _PENALTIES)
    block = np.repeat(columns.blocks(FOLDS), len(columns.weight([])))
    errors = []
    for number in range(FOLDS):
        own = block == number
        paths = _path(A[~own], y[~own], options, penalties)
        errors.append([float(np.mean((y[own] - A[own] @ c) ** 2)) for c in paths])
    mean, spread = np.mean(errors, axis=0), np.std(errors, axis=0, ddof=1)
    least = int(np.argmin(mean))
    enough = mean <= mean[least] + spread[least] / np.sqrt(FOLDS)
    return penalties[int(np.argmax(enough))]


def _path(
    A: Array, y: Array, options: list[Option], penalties: list[float]
) -> list[Array]:
    """Returns the coefficients (k,) for each of falling penalties."""
    model = _group_lasso(_groups(np.arange(A.shape[1]), options))
    found = []
    for penalty in penalties:
        model.alpha = penalty
        model.fit(np.asfortranarray(A), y)
        found.append(np.array(model.coef_))
    return found


def _group_lasso(groups: list[NDArray[Any]]) -> Any:
    try:
        from skglm import GroupLasso
    except ImportError:
        raise DisasmError(
            "`selector` group_lasso: needs skglm; pip install skglm"
        ) from None
    return GroupLasso(
        groups=[group.tolist() for group in groups],
        weights=np.sqrt([len(group) for group in groups]),
        fit_intercept=False,
        warm_start=True,
        tol=1e-4,
    )


def _groups(values: NDArray[Any], options: list[Option]) -> list[NDArray[Any]]:
    """Returns an array (k,) in parts, one for each option."""
    ends = np.cumsum([len(option.columns) for option in options])
    return np.split(values, ends[:-1])
