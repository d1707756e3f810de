"""A log of transitions as the agent's states."""

import numpy as np
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RotationMatrix

from drake_disasm.common.spatial import rotation_vector
from drake_disasm.logs.reader import Episode


def observations(episode: Episode) -> np.ndarray:
    """Returns the states (T + 1, 12) [m, rad, N, N m] of an episode of transitions.

    They are what `ObservationProcessor` gives: position and rotation vector of the
    bolt in G, then the processed wrench on it.

    Raises:
        DisasmError: the episode is of another kind.
    """
    pose = episode["X_GB_measured"]
    rotations = [_rotation_vector(quaternion) for quaternion in pose[:, 3:]]
    return np.hstack([pose[:, :3], rotations, episode["wrench"]])


def _rotation_vector(quaternion: np.ndarray) -> np.ndarray:
    unit = quaternion / np.linalg.norm(quaternion)
    return rotation_vector(RotationMatrix(Quaternion(unit)))
