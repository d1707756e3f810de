"""Episodes that contradict each other: no common effect explains both."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sysid.tracing.evidence import ALPHA, Bench
from sysid.tracing.selection import Fit
from sysid.tracing.study import family_p

_LEAST_BLOCKS = 5  # of an episode, and of all others
_LEAST_GAIN = 0.2  # of an episode's loss: far beyond what a common model leaves
_LEAST_SHARE = 0.8  # of its blocks


@dataclass(frozen=True)
class Contradiction:
    """An episode that an effect explains, with other sizes than it has elsewhere.

    Attributes:
        episode: its name.
        effect: that would explain it; the one that explains most.
        gain: share of the episode's loss that its own sizes take away, judged on
            blocks that they were not fitted to.
    """

    episode: str
    effect: str
    gain: float


def contradictions(fit: Fit, bench: Bench, own: int) -> tuple[Contradiction, ...]:
    """Returns the episodes that contradict the others, the worst first.

    Args:
        fit: with all effects that all episodes have in common.
        bench: beside it.
        own: number of the parameters that the model has anyway.
    """
    sets = _sets(fit, bench, own)
    names = fit.model.measurements.names
    found = []
    for number in np.unique(bench.episodes):
        mine = bench.episodes == number
        if min(mine.sum(), (~mine).sum()) < _LEAST_BLOCKS:
            continue
        gains = np.column_stack(
            [study.disagreement(columns, mine) for _, study, columns in sets]
        )
        p = family_p(gains) * len(names)
        share = np.mean(gains > 0.0, axis=0)
        gain = gains.sum(axis=0) / bench.raw.energy[mine].sum()
        passed = (p < ALPHA) & (share >= _LEAST_SHARE) & (gain >= _LEAST_GAIN)
        if passed.any():
            best = int(np.argmax(np.where(passed, gain, -np.inf)))
            found.append(Contradiction(names[number], sets[best][0], float(gain[best])))
    return tuple(sorted(found, key=lambda each: -each.gain))


def _sets(fit: Fit, bench: Bench, own: int) -> list[tuple]:
    """Returns what may differ: its name, a study, and the columns there."""
    base = np.arange(own)
    beside = bench.raw.beside(base)
    sets: list[tuple] = [("the model's own parameters", bench.raw, base)]
    sets += [(e.text, beside, fit.columns_of(e)) for e in fit.effects]
    sets += [(text, beside, columns) for text, columns in bench.groups.items()]
    return [each for each in sets if len(each[2])]


def in_words(found: Sequence[Contradiction]) -> str:
    """Returns which episodes contradict each other, in words; empty if none does."""
    if not found:
        return ""
    each = "; ".join(f"{c.episode} ({c.effect} differs)" for c in found)
    return f"episodes that no common effect explains: {each}"
