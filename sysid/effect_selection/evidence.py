"""Evidence for a candidate effect, and how candidates compare."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drake_disasm.effects import registered_effects
from sysid.effect_selection.block_regression import BlockRegression, Columns
from sysid.effect_selection.candidates import Candidate, is_joint_group, kind_text
from sysid.effect_selection.residual_curves import Dependence
from sysid.effect_selection.settings import SelectionSettings
from sysid.effect_selection.significance import (
    family_p,
    ranks_p,
    share_better,
    worse_p,
)

Array = NDArray[np.float64]
#: What may explain a residual: effects, or a curve of something measured.
Explanation = tuple[Candidate, ...] | Dependence


@dataclass(frozen=True)
class Evidence:
    """How well something explains the residual of blocks that were not fitted.

    Attributes:
        explanation: the effects, or the dependence.
        gain: share of the loss of those blocks that it takes away.
        p: family-wise p-value that it explains nothing.
        block_share: share of blocks that get better, of those that change noticeably.
        parameter_count: number of its parameters.
        gains: (B,) of each block.
        settings: thresholds.
        ranks_p: family-wise p-value by the signed ranks of the gains alone.
        is_further: whether it is certain already that the model lacks something.
    """

    explanation: Explanation
    gain: float
    p: float
    block_share: float
    parameter_count: int
    gains: Array
    settings: SelectionSettings = dataclasses.field(repr=False)
    ranks_p: float = 1.0
    is_further: bool = False

    @property
    def accepted(self) -> bool:
        """Whether it is significant, and large enough to be of use.

        Once it is certain that the model lacks something, what most blocks gain by is
        added, too: the rest of the residual may be slow because that is missing.
        """
        return self.gain >= self.settings.min_gain and (
            self.is_certain or (self.is_further and self.is_consistent)
        )

    @property
    def is_certain(self) -> bool:
        """Whether it is significant, however slow the noise is."""
        return self.p < self.settings.alpha

    @property
    def is_consistent(self) -> bool:
        """Whether most blocks gain by it, more than by chance if noise is fast."""
        limits = self.settings
        enough = self.block_share >= limits.min_block_share
        return enough and self.ranks_p < limits.alpha

    @property
    def name(self) -> str:
        """The effects or the dependence, in words."""
        if isinstance(self.explanation, Dependence):
            return self.explanation.text
        if is_joint_group(self.explanation):
            count = len(self.explanation)
            return f"{kind_text(self.explanation[0])} of {count} joints"
        return " and ".join(candidate.text for candidate in self.explanation)

    @property
    def candidates(self) -> tuple[Candidate, ...]:
        """The effects; none of a dependence."""
        return () if isinstance(self.explanation, Dependence) else self.explanation

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects, whatever their shapes; none of a dependence."""
        return tuple(candidate.name for candidate in self.candidates)

    def ties_with(self, best: "Evidence") -> bool:
        """Returns whether the blocks can't distinguish something else from the best."""
        too_small = self.gain < self.settings.tie_min_gain * best.gain
        if self.effects == best.effects or too_small:
            return False
        return worse_p(self.gains, best.gains) >= self.settings.alpha

    def measured(self, gains: Array, total: float, p: float) -> "Evidence":
        """Returns the evidence for the same, by gains of an actual fit.

        Args:
            gains: (B,) of each block.
            total: loss of all blocks before.
            p: that they are by chance.
        """
        if not gains.any():
            p = 1.0
        return dataclasses.replace(
            self,
            gain=float(gains.sum() / total),
            p=p,
            block_share=share_better(gains, self.settings),
            gains=gains,
        )


def rank_by_regression(
    regression: BlockRegression,
    whitened: BlockRegression,
    columns: Sequence[tuple[Explanation, Columns]],
    is_further: bool = False,
) -> list[Evidence]:
    """Returns the evidence for groups of columns, the highest gain first.

    Their p-values are for all of them as one family.

    Args:
        regression: of residuals as they are: what is gained.
        whitened: of the same prewhitened, by short blocks: whether by chance.
        columns: of each explanation.
        is_further: whether it is certain that the model lacks something.
    """
    if not columns:
        return []
    settings = regression.settings
    before, total = regression.block_losses, regression.block_losses.sum()
    gains = [before - regression.held_out_losses(group) for _, group in columns]
    p = family_p([whitened.scores(group) for _, group in columns], settings)
    ranks = ranks_p(np.array(gains).T, settings.min_gain * total, settings)
    found = [
        Evidence(
            explanation,
            float(own.sum() / total),
            float(p[i]),
            share_better(own, settings),
            len(group) + _shape_count(explanation),
            own,
            settings,
            float(ranks[i]),
            is_further and not isinstance(explanation, Dependence),
        )
        for i, ((explanation, group), own) in enumerate(
            zip(columns, gains, strict=True)
        )
    ]
    return sorted(found, key=lambda each: -each.gain)


def most_parsimonious(accepted: Sequence[Evidence]) -> Evidence:
    """Returns the simplest of those about as good as the best.

    That is the one with the fewest amplitudes, then the first of the library: dry
    friction before friction in proportion to the load. Of those that the blocks can't
    distinguish from the best, a wider margin is about as good, unless they need more
    parameters or are less common: a coupling of two joints is no simpler than viscous
    friction of all.
    """
    best, limits = accepted[0], accepted[0].settings
    order = [effect.__name__ for effect in registered_effects()]

    def _is_as_good(other: Evidence) -> bool:
        behind = best.gain - other.gain
        if behind <= limits.parsimony_tolerance * abs(best.gain):
            return True
        enough = behind <= limits.tie_parsimony_tolerance * abs(best.gain)
        no_larger = other.parameter_count <= best.parameter_count
        as_common = _places(other, order) <= _places(best, order)
        return enough and no_larger and as_common and other.ties_with(best)

    as_good = [e for e in accepted if _is_as_good(e)]
    return min(as_good, key=lambda e: (*_complexity(e, order), -e.gain))


def _complexity(evidence: Evidence, order: Sequence[str]) -> tuple[int, list[int]]:
    """Returns how many amplitudes there are, and the effects' places in the library."""
    shapes = _shape_count(evidence.explanation)
    return evidence.parameter_count - shapes, _places(evidence, order)


def _places(evidence: Evidence, order: Sequence[str]) -> list[int]:
    """Returns the effects' places in the library, where the more common come first."""
    kinds = [type(candidate.effect).__name__ for candidate in evidence.candidates]
    return sorted({order.index(k) if k in order else len(order) for k in kinds})


def _shape_count(explanation: Explanation) -> int:
    if isinstance(explanation, Dependence):
        return 0
    return sum(len(candidate.shape) for candidate in explanation)
