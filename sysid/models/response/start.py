"""Where the identification of drives begins: inverse dynamics of smoothed motions."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from sysid.models.base import Array
from sysid.models.response.drive import Drive, Inputs

_CREEP = 0.02  # rad/s, of the friction that the motion is relieved of


@dataclass(frozen=True)
class Guess:
    """Of all joints (joints,): stiffness and damping, about."""

    stiffness: Array
    damping: Array


def guessed_drives(
    load: Array, q: Array, v: Array, vd: Array, inputs: Inputs, limit: float
) -> Guess:
    """Returns drives that give what a motion took, by non-negative least squares.

    Dry friction and the rotors' inertia are fitted, too, so that they don't pass for
    the drive; where the drive was on all the time, viscous friction passes for its
    damping, as it has to.

    Args:
        load: (n, joints) torques that the rigid bodies took.
        q, v, vd: (n, joints) the motion.
        inputs: of the drives.
        limit: where they saturate.
    """
    none = np.zeros(q.shape[1])
    pull = Drive(none, none, limit).pull(q, inputs)
    found = []
    for i in range(q.shape[1]):
        on = inputs.enabled[:, i] * (inputs.rate[:, i] - v[:, i])
        rest = [-np.tanh(v[:, i] / _CREEP), -vd[:, i]]
        A = np.stack([pull[:, i], on, *rest], axis=1)
        scale = np.maximum(np.linalg.norm(A, axis=0), 1e-300)
        found.append(nnls(A / scale, load[:, i])[0][:2] / scale[:2])
    stiffness, damping = np.array(found).T
    return Guess(stiffness, damping)
