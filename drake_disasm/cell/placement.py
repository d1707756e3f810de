"""Where the lock is believed to be."""

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw

from drake_disasm.scenario import PlacementConfig


def nominal_groove_pose(placement: PlacementConfig) -> RigidTransform:
    """Returns X_WGn: x along the groove at `yaw`, y up, z across."""
    R = RollPitchYaw(np.pi / 2, 0.0, placement.yaw).ToRotationMatrix()
    return RigidTransform(R, placement.p_WG)
