"""Where the lock is believed to be."""

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw

from drake_disasm.cell.lock_dimensions import plate_bottom
from drake_disasm.scenario import LockConfig, PlacementConfig

_MIDDLE = 0.02  # m along the groove, where the bench's middle is


def nominal_groove_pose(placement: PlacementConfig) -> RigidTransform:
    """Returns X_WGn: x along the groove at `yaw`, y up, z across."""
    R = RollPitchYaw(np.pi / 2, 0.0, placement.yaw).ToRotationMatrix()
    return RigidTransform(R, placement.p_WG)


def bench_top(X_WG: RigidTransform, lock: LockConfig) -> np.ndarray:
    """Returns the middle of the bench's top (3,), in the world [m].

    Args:
        X_WG: nominal groove frame.
        lock: whose plate lies on it.
    """
    return np.asarray(X_WG @ np.array([_MIDDLE, plate_bottom(lock), 0.0]))
