"""What speaks for each candidate beside a fit: all of it from one linearisation."""

import dataclasses
import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import wilcoxon

from sysid.effect_selection.block_regression import (
    BlockRegression,
    Columns,
    family_p,
    worse_p,
)
from sysid.effect_selection.candidates import Candidate
from sysid.effect_selection.residual_curves import Dependence
from sysid.identification.linearisation import Linearisation

Array = NDArray[np.float64]
What = tuple[Candidate, ...] | Dependence

ALPHA = 0.05  # family-wise, in each round
LEAST_GAIN = 0.01  # of the loss
LEAST_SHARE = 0.8  # of the blocks
LEAST_FIELD = 0.005  # of the loss, that a size must be worth
_SIMPLER = 0.05  # of the gain, that fewer parameters may cost
_RIVAL = 0.5  # of the gain, below which nothing is a tie
_PAIRS_OF = 8
_IDLE = 0.1  # of the mean gain or loss of a block, below which it has no say
#: Effects that are listed by their names; more are alike, one for each joint.
FEW = 2


@dataclass(frozen=True)
class Evidence:
    """What speaks for something that explains a residual.

    Attributes:
        what: the effects, or the dependence.
        gain: share of the loss of blocks that were not fitted, that it takes away.
        p: family-wise, that it explains nothing.
        share: of the blocks that get better, of those that change noticeably.
        cost: number of its parameters.
        gains: (B,) of each block.
    """

    what: What
    gain: float
    p: float
    share: float
    cost: int
    gains: Array

    @property
    def accepted(self) -> bool:
        """Whether it is more than chance."""
        significant = self.p < ALPHA and self.gain >= LEAST_GAIN
        return significant and self.share >= LEAST_SHARE

    @property
    def name(self) -> str:
        """What it is, in words."""
        if isinstance(self.what, Dependence):
            return self.what.text
        if len(self.what) > FEW:
            return f"{_kind_text(self.what[0])} of {len(self.what)} joints"
        return " and ".join(candidate.text for candidate in self.what)

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects, whatever their shapes; none of a dependence."""
        if isinstance(self.what, Dependence):
            return ()
        return tuple(candidate.name for candidate in self.what)

    def ties_with(self, best: "Evidence") -> bool:
        """Returns whether blocks can't tell something else from the best."""
        if self.effects == best.effects or self.gain < _RIVAL * best.gain:
            return False
        return worse_p(self.gains, best.gains) >= ALPHA


@dataclass(frozen=True)
class Bench:
    """The one linearisation beside a fit, and what was made of it.

    Attributes:
        here: at the fit, with the candidates at null.
        fields: of each parameter, the last part of its name.
        raw: its normal equations.
        study: the same with the fit's parameters projected out.
        groups: columns of each candidate, by its text.
        dependences: curves, and the columns of each.
        episodes: (B,) the episode that each block is of.
    """

    linearisation: Linearisation
    fields: tuple[str, ...]
    raw: BlockRegression
    regression: BlockRegression
    groups: Mapping[str, Columns]
    dependences: Sequence[tuple[Dependence, Columns]]
    episodes: NDArray[np.int64]

    def everything(
        self, sets: Sequence[tuple[Candidate, ...]]
    ) -> tuple[list[Evidence], list[Evidence]]:
        """Returns the evidence for sets of candidates, and for curves, the best first.

        They are one family: a log without an effect raises neither alarm.
        """
        found = evidence(self.regression, [*self._columns(sets), *self.dependences])
        return (
            [e for e in found if not isinstance(e.what, Dependence)],
            [e for e in found if isinstance(e.what, Dependence)],
        )

    def pairs(self, singles: Sequence[Evidence]) -> list[Evidence]:
        """Returns pairs of the best that pass: some effects show only together.

        The p-values count all pairs, since the best are chosen by the same data.
        """
        promising: dict[str, Candidate] = {}
        for one in singles:
            assert isinstance(one.what, tuple)
            if len(one.what) > 1:
                continue
            promising.setdefault(one.what[0].name, one.what[0])
        best = list(promising.values())[:_PAIRS_OF]
        pairs = list(itertools.combinations(best, 2))
        tests = math.comb(len(promising), 2) / max(1, len(pairs))
        found = evidence(self.regression, self._columns(pairs))
        return [
            counted
            for e in found
            if (counted := dataclasses.replace(e, p=min(1.0, e.p * tests))).accepted
        ]

    def _columns(
        self, sets: Sequence[tuple[Candidate, ...]]
    ) -> list[tuple[What, Columns]]:
        """Returns sets of candidates with their columns, those that have any."""
        columns = [np.concatenate([self.groups[c.text] for c in s]) for s in sets]
        return [(s, c) for s, c in zip(sets, columns, strict=True) if len(c)]

    def pruned(self, added: Sequence[Candidate]) -> list[Candidate]:
        """Returns effects with only those sizes free that blocks get better by."""
        kept = [int(c) for candidate in added for c in self.groups[candidate.text]]
        now = self.regression.losses(np.array(kept)).sum()
        while len(kept) > 1:
            losses = {
                c: self.regression.losses(np.array([k for k in kept if k != c])).sum()
                for c in kept
            }
            least = min(losses, key=lambda c: losses[c])
            if losses[least] > (1.0 + LEAST_FIELD) * now:
                break
            kept.remove(least)
            now = losses[least]
        found = []
        for candidate in added:
            own = [c for c in self.groups[candidate.text] if c in kept]
            if own:
                found.append(candidate.only([self.fields[c] for c in own]))
        return found


def evidence(
    regression: BlockRegression, columns: Sequence[tuple[What, Columns]]
) -> list[Evidence]:
    """Returns the evidence for groups of columns, the highest gain first."""
    if not columns:
        return []
    gains = np.array(
        [regression.energy - regression.losses(group) for _, group in columns]
    ).T
    p, total = family_p(gains), regression.energy.sum()
    found = [
        Evidence(
            what,
            float(gains[:, i].sum() / total),
            float(p[i]),
            _share(gains[:, i]),
            len(group) + _shape_count(what),
            gains[:, i],
        )
        for i, (what, group) in enumerate(columns)
    ]
    return sorted(found, key=lambda each: -each.gain)


def measured(trial: Evidence, gains: Array, total: float, tests: int) -> Evidence:
    """Returns evidence for the same by gains (B,) that were measured.

    Args:
        trial: what was tried.
        gains: of each block.
        total: loss of all blocks before.
        tests: how many effects it was chosen from.
    """
    if not gains.any():
        return dataclasses.replace(trial, gain=0.0, p=1.0, share=0.0, gains=gains)
    p = float(wilcoxon(_concerned(gains), alternative="greater").pvalue)
    return dataclasses.replace(
        trial,
        gain=float(gains.sum() / total),
        p=min(1.0, tests * p),
        share=_share(gains),
        gains=gains,
    )


def _share(gains: Array) -> float:
    """Returns which share of blocks gets better, of those that change noticeably."""
    concerned = _concerned(gains)
    return float(np.mean(concerned > 0.0)) if len(concerned) else 0.0


def _concerned(gains: Array) -> Array:
    """Returns the gains of blocks that change noticeably, for better or for worse.

    A contact effect says nothing of blocks in which the bolt touches nothing.
    """
    size = np.abs(gains)
    return gains[size > _IDLE * size.mean()]


def simplest(accepted: Sequence[Evidence]) -> Evidence:
    """Returns the one with the fewest parameters of those as good as the best."""
    best = accepted[0]
    enough = (1.0 - _SIMPLER) * best.gain
    as_good = [e for e in accepted if e.gain >= enough]
    return min(as_good, key=lambda e: (e.cost, -e.gain))


def together(library: Sequence[Candidate]) -> list[tuple[Candidate, ...]]:
    """Returns what acts alike at several joints: what one joint has, others may.

    An arm that lacks friction at one joint lacks it at the others, and one alone would
    take up what the others lack through the rigid bodies in between.
    """
    surrogate: dict[str, list[Candidate]] = {}
    for candidate in library:
        surrogate.setdefault(_kind_text(candidate), []).append(candidate)
    return [tuple(group) for group in surrogate.values() if len(group) > 1]


def _kind_text(candidate: Candidate) -> str:
    """Returns the effect and its shape, whatever its joint."""
    kind = type(candidate.effect).__name__
    return candidate.text.replace(candidate.name, kind)


def _shape_count(what: What) -> int:
    return 0 if isinstance(what, Dependence) else sum(len(c.shape) for c in what)
