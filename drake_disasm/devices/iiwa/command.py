"""Commands to the arm's driver."""

import numpy as np
from drake import lcmt_iiwa_command

_US = 1e6


def encode_command(position: np.ndarray, time: float) -> bytes:
    """Returns the LCM message that commands a position.

    Args:
        position: (7,) of the joints [rad].
        time: when it was decided on [s].
    """
    message = lcmt_iiwa_command()
    message.utime = round(_US * time)
    message.num_joints, message.joint_position = len(position), position.tolist()
    message.num_torques, message.joint_torque = 0, []
    data: bytes = message.encode()
    return data
