"""Steps whose measured poses come late, or through another filter.

Where the arm is, is measured later then: the model of the arm says where it goes, by
command and measured wrench, and the poses that come in later, by how much it is
elsewhere. There a step begins. What is reported of a step's end follows from what was
reported of its begin: it went on as the arm did in this step and those before, as
predicted, or by the arm's model where a step is not predicted.
"""

import dataclasses
from collections.abc import Sequence
from typing import Self

import numpy as np
from numpy.typing import NDArray

from drake_disasm.effects import reported_poses
from sysid.models.base import Array

_PASSES = 3  # the first alone is an interpolation


def on_time(measured: Array, path: Array, weights: Array) -> Array:
    """Returns where the arm was (n, 6), of what was measured of it (n, 6).

    What is missed is sought later, and what that misses once more (van Cittert 1931):
    the filter is undone without its noise growing where it hides the motion.

    Args:
        measured: an episode's poses, as reported.
        path: (n, 6) where it goes by its model.
        weights: (m,) of poses in the one that is reported, see `pose_weights`.
    """
    k = np.arange(len(path), dtype=np.float64)
    later = k + np.arange(len(weights)) @ weights
    there = path
    for _ in range(_PASSES):
        missed = measured - reported_poses(there, weights)
        seen = [np.interp(later, k, column) for column in missed.T]
        there = there + np.column_stack(seen)
    return np.asarray(there)


@dataclasses.dataclass(frozen=True)
class LatePoses:
    """How the arm moves in all steps of a log by its model, in the twin's coordinates.

    Attributes:
        moved: (steps, 6) how far the arm moves in each.
        index: (steps,) number of each in its episode.
        weights: (m,) of poses in the one that is reported.
    """

    moved: Array
    index: NDArray[np.int64]
    weights: Array

    @classmethod
    def of(cls, paths: Sequence[Array], weights: Array) -> Self:
        """Returns that of the arm's paths (n + 1, 6), one for each episode."""
        moved = [np.diff(path, axis=0) for path in paths]
        index = [np.arange(len(each)) for each in moved]
        return cls(np.concatenate(moved), np.concatenate(index), weights)

    def at_ends(
        self, rows: NDArray[np.int64], before: Array, begins: Array, ends: Array
    ) -> Array:
        """Returns what is reported of the ends (n, 6) of some steps.

        Args:
            rows: (n,) their numbers among all steps.
            before: (n, 6) reported as they began.
            begins, ends: (n, 6) where they began, and led by the prediction.
        """
        moved = self.moved.copy()
        moved[rows] = ends - begins
        found = before.copy()
        for ago, weight in enumerate(self.weights):
            follows = self.index[rows] >= ago
            found[follows] += weight * moved[rows[follows] - ago]
        return found
