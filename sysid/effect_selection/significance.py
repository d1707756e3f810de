"""p-values of what blocks of rows gain, by signed ranks."""

import numpy as np
from numpy.typing import NDArray
from scipy.stats import rankdata, wilcoxon

from sysid.effect_selection.settings import SelectionSettings

Array = NDArray[np.float64]

# Rounding errors, not thresholds: gains that differ by less are the same number.
_EQUAL = 1e-6  # of the largest gain of a block
_ROUNDING = 1e-12  # of a sum of unit ranks


def family_p(gains: Array, settings: SelectionSettings, seed: int = 0) -> Array:
    """Returns each candidate's family-wise p-value (k,) that it explains nothing.

    The statistic is Wilcoxon's sum of signed ranks of what blocks gain by a candidate
    when they are predicted from all others. Its null distribution is that of the
    highest over all candidates, with the blocks' signs flipped at random, the same
    for all candidates (Westfall and Young 1993): this allows for any correlation
    within a block and between candidates, and no single block dominates. The price of
    a candidate's parameters is in its gains.

    Args:
        gains: (B, k), of each block by each candidate.
        settings: number of draws.
        seed: of the signs.
    """
    draws = settings.sign_flips
    ranks = np.sign(gains) * rankdata(np.abs(gains), axis=0)
    unit = ranks / np.maximum(np.linalg.norm(ranks, axis=0), 1e-300)
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], (draws, len(gains)))
    highest = (signs @ unit).max(axis=1, initial=0.0)
    above = (highest[:, None] >= unit.sum(axis=0) - _ROUNDING).sum(axis=0)
    p: Array = (1.0 + above) / (1.0 + draws)
    return p


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


def changed_blocks(gains: Array, settings: SelectionSettings) -> Array:
    """Returns the gains of the blocks that change noticeably, better or worse."""
    size = np.abs(gains)
    return gains[size > settings.idle_block_gain * size.mean()]


def share_better(gains: Array, settings: SelectionSettings) -> float:
    """Returns the share of blocks that get better, of those that change noticeably."""
    changed = changed_blocks(gains, settings)
    return float(np.mean(changed > 0.0)) if len(changed) else 0.0
