"""Where the lock is believed to be."""

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw

from drake_disasm.parts import Part
from drake_disasm.scenario import PlacementConfig

#: Where along the groove the middle of the bench is [m].
MIDDLE = 0.02


def nominal_groove_pose(placement: PlacementConfig) -> RigidTransform:
    """Returns X_WGn: x along the groove at `yaw`, y up, z across."""
    R = RollPitchYaw(np.pi / 2, 0.0, placement.yaw).ToRotationMatrix()
    return RigidTransform(R, placement.p_WG)


def bench_top(X_WG: RigidTransform, part: Part) -> np.ndarray:
    """Returns the middle of the bench's top (3,), in the world [m].

    Args:
        X_WG: nominal groove frame.
        part: what lies on it.
    """
    return np.asarray(X_WG @ np.array([MIDDLE, part.bottom, 0.0]))
