"""Since when in a log an effect acts: one break, tested against none."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.effect_selection.linear_account import LinearAccount
from sysid.fitting.block_grams import Array, Columns, NormalEquations

#: Andrews' critical value of sup-Wald for one coefficient, breaks in the middle 70 % of
#: the rows, 1 % (D. W. K. Andrews, Econometrica 61, 1993, table I).
_SUP_WALD = 12.35
_EDGE = 0.15  # of the rows at either end, in which no break is looked for


@dataclass(frozen=True)
class Onset:
    """A break within a log.

    Attributes:
        effect: its name.
        episode: in which it begins, a number of the model's measurements.
        row: of that episode, from 0; known to a block of rows.
        block_rows: number of rows that a block has.
        is_new: whether the effect is absent before; else it only grows or falls there.
    """

    effect: str
    episode: int
    row: int
    block_rows: int
    is_new: bool


def onsets(account: LinearAccount, is_newer: NDArray[np.bool_]) -> tuple[Onset, ...]:
    """Returns the breaks of effects within newer logs.

    Each effect's coefficients are fitted before and after each block; the largest Wald
    statistic of their difference, with a covariance that allows for residuals that are
    correlated, tells whether there is a break, and the least loss where.

    Args:
        account: of a model with effects that act in newer logs.
        is_newer: (B,) whether a block of rows is of a newer log.
    """
    equations = account.whole
    found = []
    for name, columns in account.owners.items():
        onset = _onset(equations, account.columns, columns, is_newer, name)
        if onset is not None:
            found.append(onset)
    return tuple(found)


def _onset(
    equations: NormalEquations,
    all_columns: Columns,
    own: Columns,
    is_newer: NDArray[np.bool_],
    name: str,
) -> Onset | None:
    """Returns the break of one effect; None if there is none."""
    newer = np.flatnonzero(is_newer)
    edge = int(np.ceil(_EDGE * len(newer)))
    breaks = newer[max(edge, 1) : len(newer) - max(edge, 1)]
    rest = np.setdiff1d(all_columns, own)
    best: tuple[float, int, Array] | None = None
    for b in breaks:
        both = _split(equations, rest, own, int(b))
        count = len(rest)
        columns = np.arange(count + 2 * len(own))
        x, C = both.solution(columns), both.covariance(columns)
        before = slice(count, count + len(own))
        after = slice(count + len(own), None)
        difference = x[after] - x[before]
        V = C[after, after] + C[before, before] - 2.0 * C[before, after]
        wald = difference**2 / np.maximum(np.diagonal(V), 1e-300)
        if best is None or wald.max() > best[0]:
            alone = x[before] ** 2 / np.maximum(np.diagonal(C[before, before]), 1e-300)
            best = (float(wald.max()), int(b), alone)
    if best is None or best[0] < _SUP_WALD * len(own):
        return None
    _, b, alone = best
    episode = int(equations.episode[b])
    first = int(np.flatnonzero(equations.episode == episode)[0])
    row = int(equations.rows[first:b].sum())
    return Onset(name, episode, row, int(equations.rows[b]), bool(alone.max() < 4.0))


def _split(
    equations: NormalEquations, rest: Columns, own: Columns, b: int
) -> NormalEquations:
    """Returns equations in which an effect has other coefficients from a block on."""
    kept = np.concatenate([rest, own, own])
    small = equations.of_columns(kept)
    before = slice(len(rest), len(rest) + len(own))
    after = slice(len(rest) + len(own), len(kept))
    blocks = small.blocks.copy()
    for blocks_of, none in ((slice(b, None), before), (slice(0, b), after)):
        blocks[blocks_of, none] = 0.0
        blocks[blocks_of, :, none] = 0.0
    return NormalEquations(blocks, small.rows, small.episode, small.bounds, small.power)
