"""Finds episodes that contradict each other: no common effect explains both."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.effect_selection.forward_selection import largest_t_p
from sysid.effect_selection.linear_account import LinearAccount
from sysid.fitting.block_grams import Columns, NormalEquations

_OWN = "the model's own parameters"
_MOST = 40  # episodes: of more, one by one, the time is not spent


@dataclass(frozen=True)
class Contradiction:
    """Episodes that an effect explains only with different amplitudes in each.

    Attributes:
        episodes: names; one that differs from all others, or the only two.
        effect: that differs; the simplest of those that explain most.
        gain: share of the loss that this takes away, judged on blocks that were not
            fitted.
    """

    episodes: tuple[str, ...]
    effect: str
    gain: float


def contradictions(
    account: LinearAccount, names: tuple[str, ...], is_noise: bool
) -> tuple[Contradiction, ...]:
    """Returns the episodes that contradict the others, the worst first.

    A candidate whose amplitudes may differ in one episode is compared with the same
    with common amplitudes, on blocks that were not fitted.

    Args:
        account: at the fit with all effects that the episodes have in common.
        names: of the episodes.
        is_noise: whether channels whose noise is known leave nothing to explain.
    """
    blocks_each = len(account.system.grams.rows) // max(1, len(names))
    if not 1 < len(names) <= _MOST or blocks_each < 2 or is_noise:
        return ()
    numbers = range(len(names)) if len(names) > 2 else [1]
    whole, sets = account.whole, _sets(account)
    found = []
    for number in numbers:
        best = _difference(account, whole, sets, number, len(numbers))
        if best:
            which = (names[number],) if len(names) > 2 else names
            found.append(Contradiction(which, *best))
    return tuple(sorted(found, key=lambda each: -each.gain))


def _sets(account: LinearAccount) -> list[tuple[str, Columns]]:
    """Returns what may differ in an episode, in words, with its columns."""
    empty = np.array([], dtype=np.int64)
    effects = np.concatenate([empty, *account.owners.values()])
    own = np.setdiff1d(account.columns, effects)
    sets = [
        *(
            (t.candidates[0].text, t.columns)
            for t in account.terms
            if len(t.names) == 1
        ),
        *account.owners.items(),
        (_OWN, own),
    ]
    return [(text, columns) for text, columns in sets if len(columns)]


def _difference(
    account: LinearAccount,
    whole: NormalEquations,
    sets: Sequence[tuple[str, Columns]],
    number: int,
    episodes: int,
) -> tuple[str, float] | None:
    """Returns what differs in an episode and how much that explains; else None.

    Args:
        account: see `contradictions`.
        whole: its normal equations.
        sets: what may differ.
        number: of the episode.
        episodes: how many are asked.
    """
    limits, passed, tests = account.settings, [], episodes * len(sets)
    for text, columns in sets:
        base = np.setdiff1d(account.columns, columns)
        both = _with_own(whole, base, columns, number)
        gain, p = _gain(both, len(columns), limits.folds)
        if gain >= limits.min_gain and p * tests < limits.alpha:
            passed.append((text, gain, len(columns)))
    if not passed:
        return None
    enough = (1.0 - limits.ambiguity_margin) * max(gain for _, gain, _ in passed)
    good = [each for each in passed if each[1] >= enough]
    text, gain, _ = min(good, key=lambda each: each[2])
    return text, gain


def _with_own(
    equations: NormalEquations, base: Columns, columns: Columns, number: int
) -> NormalEquations:
    """Returns equations of base, columns, and copies of these that act in an episode.

    The copies come last.
    """
    small = equations.of_columns(np.append(base, columns))
    shared, k = len(base) + len(columns), len(columns)
    order = np.concatenate([np.arange(shared), np.arange(len(base), shared + 1)])
    blocks = small.blocks[:, order][:, :, order]
    acts, copies = small.episode == number, slice(shared, shared + k)
    blocks[~acts, copies] = 0.0
    blocks[~acts, :, copies] = 0.0
    power = np.einsum("bii->i", blocks)[:-1]
    bounds = np.zeros((shared + k, 2))  # nothing is asked that needs them
    return NormalEquations(blocks, small.rows, small.episode, bounds, power)


def _gain(both: NormalEquations, k: int, folds: int) -> tuple[float, float]:
    """Returns what the last k columns gain beside all others, and its p-value."""
    shared = len(both.power) - k
    left = both.projected(np.arange(shared))
    copies: NDArray[np.int64] = np.arange(shared, shared + k)
    copies = copies[left.is_new(copies)]
    if not len(copies):
        return 0.0, 1.0
    x, C = left.solution(copies), left.covariance(copies)
    p = largest_t_p(x, C, left.degrees_of_freedom)
    return left.folds(folds).held_out_gain(copies), p
