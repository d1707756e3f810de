"""Since when in newer logs something has changed."""

import numpy as np
from numpy.typing import NDArray

from sysid.effect_selection.linear_account import LinearAccount
from sysid.fitting.block_grams import Columns, NormalEquations

_EDGE = 0.1  # of the blocks at either end: too few to tell a change by


def onset_block(account: LinearAccount, is_newer: NDArray[np.bool_]) -> int | None:
    """Returns the block of rows from which on one more change is worth most.

    Any effect, also one that the model has, acts from each block in turn to the end,
    and is fitted besides what acts from the beginning. None, if none of them takes
    away `min_gain` of the held-out loss.

    Args:
        account: of a model with the changes that act from the beginning.
        is_newer: (B,) whether a block is of a newer log; those come last.
    """
    newer = np.flatnonzero(is_newer)
    edge = max(1, int(np.ceil(_EDGE * len(newer))))
    breaks = newer[edge : len(newer) - edge]
    gains = [_best_gain(account, int(b)) for b in breaks]
    if not gains or max(gains) < account.settings.min_gain:
        return None
    return int(breaks[int(np.argmax(gains))])


def _best_gain(account: LinearAccount, b: int) -> float:
    """Returns the largest share of the loss that an effect since a block takes away."""
    sets = [term.columns for term in account.system.terms]
    sets += list(account.owners.values())
    late = np.unique(np.concatenate(sets))
    equations = _with_late(account.whole, account.columns, late, b)
    folds = equations.folds(account.settings.folds)
    folds = folds.projected(np.arange(len(account.columns)))
    gains = [0.0]
    for columns in sets:
        own = len(account.columns) + np.searchsorted(late, columns)
        own = own[folds.is_new(own)]
        if len(own):
            gains.append(folds.held_out_gain(own))
    return max(gains)


def _with_late(
    equations: NormalEquations, columns: Columns, late: Columns, b: int
) -> NormalEquations:
    """Returns the equations of columns, and of others that are zero before a block."""
    found = equations.of_columns(np.concatenate([columns, late]))
    own = slice(len(columns), len(columns) + len(late))
    found.blocks[:b, own] = 0.0
    found.blocks[:b, :, own] = 0.0
    found.power[own] = np.einsum("bii->i", found.blocks)[own]
    return found
