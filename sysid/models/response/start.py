"""Where the identification of drives begins: inverse dynamics of smoothed motions."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from sysid.models.base import Array
from sysid.models.response.drive import Drive, Inputs

_CREEP = 0.02  # rad/s, of the friction that the motion is relieved of


@dataclass(frozen=True)
class Guess:
    """About what the drives are.

    Attributes:
        stiffness, damping: of all joints (joints,).
        delay: of the goal [s].
        left: (joints,) share of the torques that they don't give.
    """

    stiffness: Array
    damping: Array
    delay: float
    left: Array


def guessed_drives(
    load: Array,
    q: Array,
    v: Array,
    vd: Array,
    inputs: Mapping[float, Inputs],
    limit: float,
) -> Guess:
    """Returns drives and the delay with which they give best what a motion took.

    Args:
        load, q, v, vd, limit: see `_of_delay`.
        inputs: of the drives, by the delay of the goal [s].
    """
    found = [_of_delay(load, q, v, vd, i, t, limit) for t, i in inputs.items()]
    return min(found, key=lambda guess: float(np.sum(guess.left)))


def _of_delay(
    load: Array,
    q: Array,
    v: Array,
    vd: Array,
    inputs: Inputs,
    delay: float,
    limit: float,
) -> Guess:
    """Returns drives that give what a motion took, by non-negative least squares.

    Dry friction and the rotors' inertia are fitted, too, so that they don't pass for
    the drive; where the drive was on all the time, viscous friction passes for its
    damping, as it has to.

    Args:
        load: (n, joints) torques that the rigid bodies took.
        q, v, vd: (n, joints) the motion.
        inputs: of the drives, with this delay.
        delay: of the goal [s].
        limit: where they saturate.
    """
    none = np.zeros(q.shape[1])
    pull = Drive(none, none, limit).pull(q, inputs)
    found, left = [], []
    for i in range(q.shape[1]):
        on = inputs.enabled[:, i] * (inputs.rate[:, i] - v[:, i])
        rest = [-np.tanh(v[:, i] / _CREEP), -vd[:, i]]
        A = np.stack([pull[:, i], on, *rest], axis=1)
        scale = np.maximum(np.linalg.norm(A, axis=0), 1e-300)
        x, missed = nnls(A / scale, load[:, i])
        found.append(x[:2] / scale[:2])
        left.append((missed / max(float(np.linalg.norm(load[:, i])), 1e-300)) ** 2)
    stiffness, damping = np.array(found).T
    return Guess(stiffness, damping, delay, np.array(left))
