"""Commanded motion of measured episodes, and what effects on the motion make of it."""

import dataclasses
from collections.abc import Sequence
from typing import Self

import numpy as np
from scipy.spatial.transform import Rotation

from drake_disasm.cell.coordinates import BoltCoordinates
from drake_disasm.common.rotations import Pose, rotation_matrices, rotation_vectors
from drake_disasm.effects import MotionEffect
from drake_disasm.logs import Episode
from drake_disasm.systems.pose_target import through_motion
from sysid.models.base import Array


@dataclasses.dataclass(frozen=True)
class Commands:
    """Commanded motion of an episode of n steps.

    Attributes:
        path: (n + 1, 6) commanded position and rotation vector of B in G [m, rad].
        wrench: (n + 1, 6) [f; tau] measured on the bolt at Bo in G.
        period: of the MDP [s].
    """

    path: Array
    wrench: Array
    period: float

    @classmethod
    def of(cls, episode: Episode, period: float) -> Self:
        """Returns the commands of an episode of transitions."""
        pose = episode["X_GB_commanded"]
        turn = Rotation.from_quat(pose[:, [4, 5, 6, 3]]).as_rotvec()
        return cls(np.hstack([pose[:, :3], turn]), episode["wrench"], period)

    def executed(self, effects: Sequence[MotionEffect]) -> Array:
        """Returns the path (n + 1, 6) executed under effects in the chain's order."""
        path, memories = [self.path[0]], np.zeros((len(effects), 6))
        for commanded, wrench in zip(self.path[1:], self.wrench, strict=False):
            executed, memories = through_motion(
                effects, commanded, wrench, memories, self.period
            )
            path.append(executed)
        return np.array(path)


def bolt_path(coordinates: Array, p_BoTo_B: Array) -> Array:
    """Returns positions and rotation vectors (n, 6) of B in G: see `twin_coordinates`.

    Args:
        coordinates: (n, 6) of the twin.
        p_BoTo_B: (3,) see `BoltCoordinates`.
    """
    X_GB = BoltCoordinates(p_BoTo_B).poses(coordinates)
    return np.hstack([X_GB.p, rotation_vectors(X_GB.R)])


def twin_coordinates(path: Array, p_BoTo_B: Array) -> Array:
    """Returns the twin's coordinates (n, 6) of positions and rotation vectors (n, 6).

    Args:
        path: of B in G.
        p_BoTo_B: (3,) see `BoltCoordinates`.
    """
    X_GB = Pose(rotation_matrices(path[:, 3:]), path[:, :3])
    return np.asarray(BoltCoordinates(p_BoTo_B).of_poses(X_GB))
