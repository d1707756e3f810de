"""p-values of what blocks of rows say: by flips of their signs, and by signed ranks."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import rankdata, wilcoxon

from sysid.effect_selection.settings import SelectionSettings

Array = NDArray[np.float64]

# Rounding errors, not thresholds: gains that differ by less are the same number.
_EQUAL = 1e-6  # of the largest gain of a block
_ROUNDING = 1e-12  # of a sum of unit scores


@dataclass(frozen=True)
class Scores:
    """What blocks of rows say of a candidate.

    Attributes:
        total: (m,) whose squared length is about chi-squared with m degrees of freedom
            by chance.
        blocks: (B, m) what it is the sum of by chance; each of either sign.
        least_p: of n blocks that count, no flips of signs give less than 2^(1 - n).
    """

    total: Array
    blocks: Array
    least_p: float = 0.0


def family_p(
    scores: Sequence[Scores], settings: SelectionSettings, seed: int = 0
) -> Array:
    """Returns each candidate's family-wise p-value (k,) that it explains nothing.

    The statistic is normalised for its degrees of freedom, and its null distribution
    is that of the highest over all candidates with the blocks' signs flipped at random,
    the same for all candidates (Westfall and Young 1993): this allows for any
    correlation within a block and between candidates, and for noise that differs from
    block to block.

    Args:
        scores: of each candidate.
        settings: number of draws.
        seed: of the signs.
    """
    found = np.array([_normalised(each.total[None])[0] for each in scores])
    highest = highest_by_chance(scores, settings, seed)
    above = (highest[:, None] >= found - _ROUNDING).sum(axis=0)
    p: Array = (1.0 + above) / (1.0 + len(highest))
    return np.maximum(p, [each.least_p for each in scores])


def ranks_p(
    gains: Array, least: float, settings: SelectionSettings, seed: int = 0
) -> Array:
    """Returns each candidate's family-wise p-value (k,) of signed ranks of its gains.

    Wilcoxon's sum of signed ranks, against the highest of all candidates with signs
    flipped at random. One-sided: losses speak for nothing. Of the flipped ones those
    count that gain enough to be added: of a dozen blocks and two hundred candidates,
    one of those that gain next to nothing has all of its signs right too often for any
    other to pass. Blocks have to be longer than residuals stay correlated: noise that
    is slower than a tenth of a log raises alarms.

    Args:
        gains: (B, k), of each block by each candidate.
        least: gain of all blocks together below which none is added.
        settings: number of draws.
        seed: of the signs.
    """
    ranks = np.sign(gains) * rankdata(np.abs(gains), axis=0)
    unit = ranks / np.maximum(np.linalg.norm(ranks, axis=0), 1e-300)
    size = (settings.sign_flips, len(gains))
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], size)
    by_chance = np.where(signs @ gains >= least, signs @ unit, -np.inf).max(axis=1)
    above = (by_chance[:, None] >= unit.sum(axis=0) - _ROUNDING).sum(axis=0)
    return np.asarray((1.0 + above) / (1.0 + len(signs)))


def highest_by_chance(
    scores: Sequence[Scores], settings: SelectionSettings, seed: int = 0
) -> Array:
    """Returns the highest statistic (draws,) of all scores with random signs."""
    size = (settings.sign_flips, max(len(each.blocks) for each in scores))
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], size)
    highest = np.full(len(signs), -np.inf)
    for each in scores:
        np.maximum(highest, _normalised(signs @ each.blocks), out=highest)
    return highest


def _normalised(sums: Array) -> Array:
    """Returns the squared sums (n, m) as standard normal variables (n,), about.

    Wilson and Hilferty's (1931) cube root of a chi-squared variable.
    """
    m = max(sums.shape[1], 1)
    spread = 2.0 / (9.0 * m)
    root = np.cbrt(np.sum(sums**2, axis=1) / m)
    return np.asarray((root - 1.0 + spread) / np.sqrt(spread))


def squared_length(normalised: float, m: int) -> float:
    """Returns the squared sum of m scores that is a normalised statistic."""
    spread = 2.0 / (9.0 * m)
    return float(m * max(normalised * np.sqrt(spread) + 1.0 - spread, 0.0) ** 3)


def worse_p(gains: Array, best: Array) -> float:
    """Returns the p-value that gains (B,) are no less than the best's, block by block.

    Wilcoxon's signed ranks of the differences: two candidates that explain the same
    blocks by as much can't be distinguished, whatever their totals.
    """
    difference = best - gains
    if not np.abs(difference).max(initial=0.0) > _EQUAL * np.abs(best).max(initial=0.0):
        return 1.0
    return greater_p(difference)


def greater_p(gains: Array) -> float:
    """Returns the p-value of Wilcoxon's signed ranks that gains (B,) are about zero."""
    return float(wilcoxon(gains, alternative="greater").pvalue)


def gained_p(gains: Array, settings: SelectionSettings) -> float:
    """Returns the p-value that blocks gain (B,) by chance, idle ones not counted."""
    changed = changed_blocks(gains, settings)
    return greater_p(changed) if changed.any() else 1.0


def changed_blocks(gains: Array, settings: SelectionSettings) -> Array:
    """Returns the gains of the blocks that change noticeably, better or worse."""
    size = np.abs(gains)
    return gains[size > settings.idle_block_gain * size.mean()]


def share_better(gains: Array, settings: SelectionSettings) -> float:
    """Returns the share of blocks that get better, of those that change noticeably."""
    changed = changed_blocks(gains, settings)
    return float(np.mean(changed > 0.0)) if len(changed) else 0.0
