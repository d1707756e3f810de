"""Episodes that contradict each other: no common effect explains both."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.effect_selection.block_regression import BlockRegression, Columns, family_p
from sysid.effect_selection.evidence import ALPHA, Bench
from sysid.effect_selection.fit import Fit

_MOST_EPISODES = 12  # with more, one alone hardly shows, and imprecision is the word
_LEAST_GAIN = 0.2  # of the loss: far beyond what a common model leaves
_LEAST_SHARE = 0.8  # of the blocks
_SIMPLER = 0.1  # of the gain, that fewer parameters may cost
_OWN = "the model's own parameters"


@dataclass(frozen=True)
class Contradiction:
    """Episodes that an effect explains only with other sizes in each.

    Attributes:
        episodes: names; one that differs from all others, or the only two.
        effect: that differs; the simplest of those that explain most.
        gain: share of the loss that this takes away, judged on blocks that were not
            fitted.
    """

    episodes: tuple[str, ...]
    effect: str
    gain: float


def contradictions(fit: Fit, bench: Bench, own: int) -> tuple[Contradiction, ...]:
    """Returns the episodes that contradict the others, the worst first.

    A candidate whose sizes may differ in one episode is held against the same with
    common sizes, on blocks that were not fitted.

    Args:
        fit: with all effects that all episodes have in common.
        bench: beside it.
        own: number of the parameters that the model has anyway.
    """
    names = fit.model.measurements.names
    if not 1 < len(names) <= _MOST_EPISODES or _is_noise(fit):
        return ()
    numbers = range(len(names)) if len(names) > 2 else [1]
    found = []
    for number in numbers:
        best = _differs(fit, bench, own, number, len(numbers))
        if best:
            which = (names[number],) if len(names) > 2 else names
            found.append(Contradiction(which, *best))
    return tuple(sorted(found, key=lambda each: -each.gain))


def _is_noise(fit: Fit) -> bool:
    """Returns whether channels whose noise is known leave nothing to explain."""
    return not fit.model.affine and fit.value < 1.0


def _differs(
    fit: Fit, bench: Bench, own: int, number: int, tests: int
) -> tuple[str, float] | None:
    """Returns what differs in an episode and by how much that explains; else None."""
    count, size = len(fit.theta), len(bench.fields)
    regression = bench.raw.apart(bench.episodes == number, size).project_out(
        np.arange(count)
    )
    begin = len(bench.raw.scale)
    sets = [(text, columns) for text, columns in bench.groups.items() if len(columns)]
    sets += [(e.text, fit.columns_of(e)) for e in fit.effects]
    sets.append((_OWN, np.arange(own)))
    gains = np.column_stack([_gains(regression, columns, begin) for _, columns in sets])
    p, share = family_p(gains) * tests, np.mean(gains > 0.0, axis=0)
    gain = gains.sum(axis=0) / regression.energy.sum()
    passed = (p < ALPHA) & (share >= _LEAST_SHARE) & (gain >= _LEAST_GAIN)
    if not passed.any():
        return None
    enough = (1.0 - _SIMPLER) * gain[passed].max()
    good = np.flatnonzero(passed & (gain >= enough))
    best = min(good, key=lambda i: len(sets[i][1]))
    return sets[best][0], float(gain[best])


def _gains(
    regression: BlockRegression, columns: Columns, begin: int
) -> NDArray[np.float64]:
    """Returns what blocks gain, (B,), if columns may differ in the episode."""
    both = np.concatenate([columns, begin + columns])
    return regression.losses(columns) - regression.losses(both)


def in_words(found: Sequence[Contradiction]) -> str:
    """Returns which episodes contradict each other, in words; empty if none does."""
    if not found:
        return ""
    each = "; ".join(f"{' against '.join(c.episodes)} ({c.effect})" for c in found)
    return f"episodes that no common effect explains: {each}"
