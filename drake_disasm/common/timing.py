"""When the MDP's systems act within a period.

The plant steps at every multiple of the period, and k * 0.1 and 40 k * 0.0025 differ in
the last bit for some k. Acting a little later than the multiple, far more than rounding
and far less than a plant step, gives every period the same number of plant steps. The
motion acts after the policy, so that it moves by the action that belongs to this
period's observation.
"""

import numpy as np

#: Policy and task monitor act this long after each multiple of the period [s].
POLICY_DELAY = 1e-6

#: The pose target takes up the policy's action this long after it [s].
MOTION_DELAY = 2e-6

#: The gripper's command leaves this long after the arm's was decided on [s]. At the
#: same time it would leave before, being published at the end of the step that led
#: there. It leaves before the policy acts, which may take its time.
GRIPPER_DELAY = 5e-7


def boundary(steps: int, period: float) -> float:
    """Returns the time [s] at which the policy acts after `steps` periods.

    A simulator advanced to it has made the plant's last step and not yet asked the
    policy: what is read there is what the policy will see, and the last step's
    reward. The arithmetic is Drake's own for a periodic event, to the last bit.
    """
    return POLICY_DELAY + steps * period


def newest_step(time: float, time_step: float) -> float:
    """Returns when a discrete plant made its newest step [s]."""
    return float(np.floor(time / time_step + 1e-6)) * time_step
