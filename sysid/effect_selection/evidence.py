"""Evidence for a candidate effect, and how candidates compare."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid.effect_selection.block_regression import BlockRegression, Columns
from sysid.effect_selection.candidates import Candidate, is_joint_group, kind_text
from sysid.effect_selection.residual_curves import Dependence
from sysid.effect_selection.settings import SelectionSettings
from sysid.effect_selection.significance import (
    changed_blocks,
    family_p,
    greater_p,
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
    """

    explanation: Explanation
    gain: float
    p: float
    block_share: float
    parameter_count: int
    gains: Array
    settings: SelectionSettings = dataclasses.field(repr=False)

    @property
    def accepted(self) -> bool:
        """Whether it is significant, large enough, and consistent over the blocks."""
        limits = self.settings
        significant = self.p < limits.alpha and self.gain >= limits.min_gain
        return significant and self.block_share >= limits.min_block_share

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

    def measured(self, gains: Array, total: float, tests: int) -> "Evidence":
        """Returns the evidence for the same, by gains of an actual fit.

        Args:
            gains: (B,) of each block.
            total: loss of all blocks before.
            tests: how many effects it was chosen from (Bonferroni).
        """
        if not gains.any():
            return dataclasses.replace(
                self, gain=0.0, p=1.0, block_share=0.0, gains=gains
            )
        p = greater_p(changed_blocks(gains, self.settings))
        return dataclasses.replace(
            self,
            gain=float(gains.sum() / total),
            p=min(1.0, tests * p),
            block_share=share_better(gains, self.settings),
            gains=gains,
        )


def rank_by_regression(
    regression: BlockRegression, columns: Sequence[tuple[Explanation, Columns]]
) -> list[Evidence]:
    """Returns the evidence for groups of columns, the highest gain first.

    Their p-values are for all of them as one family.
    """
    if not columns:
        return []
    settings = regression.settings
    before = regression.block_losses
    gains = np.array(
        [before - regression.held_out_losses(group) for _, group in columns]
    ).T
    p, total = family_p(gains, settings), before.sum()
    found = [
        Evidence(
            explanation,
            float(gains[:, i].sum() / total),
            float(p[i]),
            share_better(gains[:, i], settings),
            len(group) + _shape_count(explanation),
            gains[:, i],
            settings,
        )
        for i, (explanation, group) in enumerate(columns)
    ]
    return sorted(found, key=lambda each: -each.gain)


def most_parsimonious(accepted: Sequence[Evidence]) -> Evidence:
    """Returns the one with the fewest parameters of those about as good as the best."""
    best = accepted[0]
    enough = (1.0 - best.settings.parsimony_tolerance) * best.gain
    as_good = [e for e in accepted if e.gain >= enough]
    return min(as_good, key=lambda e: (e.parameter_count, -e.gain))


def _shape_count(explanation: Explanation) -> int:
    if isinstance(explanation, Dependence):
        return 0
    return sum(len(candidate.shape) for candidate in explanation)
