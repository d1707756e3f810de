"""What happened in the episodes of a batch, in the layout of a log of transitions."""

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from drake_disasm.common.arrays import to_numpy
from drake_disasm.common.rotations import Pose
from drake_disasm.mdp import REWARD_TERMS, is_terminated, is_truncated
from drake_disasm.twin.batch import BatchedTwin, BatchResult

_NO_STEP = ("action", "action_executed", *(f"reward.{n}" for n in REWARD_TERMS))


class BatchHistory:
    """Collects what all environments measure and do, from their start on.

    Args:
        twin: just reset.
    """

    def __init__(self, twin: BatchedTwin) -> None:
        self._twin = twin
        self._drawn = [dict(values) for values in twin.drawn]
        self._begun = np.zeros(twin.count, np.int64)
        self._steps: list[dict[str, np.ndarray]] = []
        self._measured: list[dict[str, np.ndarray]] = []
        self._measured.append(self._measure(np.zeros(twin.count, np.int64)))

    def begin(self, rows: np.ndarray) -> None:
        """Takes episodes of some environments (m,) that have just begun.

        Those before are forgotten.
        """
        beginning = self._measure(np.zeros(self._twin.count, np.int64))
        for name, values in self._measured[-1].items():
            values[rows] = beginning[name][rows]
        for row in rows:
            self._drawn[row] = dict(self._twin.drawn[row])
        self._begun[rows] = len(self._steps)
        past = int(self._begun.min())
        del self._steps[:past], self._measured[:past]
        self._begun -= past

    def add(self, result: BatchResult) -> None:
        """Takes a step that was just done."""
        terms = {f"reward.{n}": t for n, t in result.reward_terms.items()}
        step = {
            "action": self._twin.action,
            "action_executed": self._twin.action_executed,
        } | terms
        self._steps.append({name: _copied(value) for name, value in step.items()})
        failed = to_numpy(result.has_failed)
        self._measured.append(self._measure(to_numpy(result.outcome), failed))

    def episode(self, row: int, steps: int) -> dict[str, np.ndarray]:
        """Returns the episode of an environment as `EpisodeRecorder.columns` does.

        Args:
            row: its number.
            steps: of the episode.
        """
        count, first = steps + 1, int(self._begun[row])
        measured = self._measured[first : first + count]
        rows: dict[str, Any] = {
            name: np.stack([m[name][row] for m in measured]) for name in measured[0]
        }
        for name in _NO_STEP:
            done = [step[name][row] for step in self._steps[first : first + steps]]
            last = np.zeros_like(self._steps[0][name][row])
            rows[name] = np.stack([*done, last])
        rows["time"] = self._twin.period * np.arange(count)
        rows["q"] = np.zeros((count, 0))
        for parameter, value in self._drawn[row].items():
            rows[f"extra.{parameter}"] = np.full(count, value)
        return rows

    def _measure(
        self, outcome: np.ndarray, failed: np.ndarray | bool = False
    ) -> dict[str, np.ndarray]:
        twin = self._twin
        found = {
            "X_GB_measured": _pose_vectors(twin.pose_measured()),
            "X_GB_commanded": _pose_vectors(twin.episodes.commanded),
            "wrench": _copied(twin.observation[:, 6:]),
            "ft_sensor": _copied(twin.reading),
            "terminated": is_terminated(outcome),
            "truncated": is_truncated(outcome),
        }
        for name, values in found.items():  # a failed simulation stays as it was
            broken = ~np.isfinite(values.reshape(twin.count, -1)).all(axis=1) | failed
            if broken.any():
                values[broken] = self._measured[-1][name][broken]
        return found


def _copied(values: Any) -> np.ndarray:
    return np.array(to_numpy(values))


def _pose_vectors(X: Pose) -> np.ndarray:
    """Returns [x, y, z, qw, qx, qy, qz] with qw >= 0 of n poses, (n, 7).

    NaN where a pose is not finite.
    """
    R, p = to_numpy(X.R), to_numpy(X.p)
    is_finite = np.isfinite(R).all(axis=(1, 2)) & np.isfinite(p).all(axis=1)
    found = np.full((len(p), 7), np.nan)
    xyzw = Rotation.from_matrix(R[is_finite]).as_quat(canonical=True)
    found[is_finite] = np.hstack([p[is_finite], xyzw[:, 3:], xyzw[:, :3]])
    return found
