"""The gravity that is in an arm's torques, by nominal torques."""

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from drake_disasm.effects import ArmTilt
from sysid.models.arm_motion import ArmMotion
from sysid.models.channel_grams import (
    FAR_BETTER,
    STANDARD_ERRORS,
    ChannelGrams,
    angle_between,
    is_lower,
    jackknife_error,
)
from sysid.models.regressor import ArmRegressor

Array = NDArray[np.float64]
#: Gives an arm under a gravity (3,) in the base's frame.
ArmUnder = Callable[[Array], ArmRegressor]

#: Base tilts up to here are an effect of their own.
_MOST_TILT = next(f.metadata["high"] for f in fields(ArmTilt) if f.name == "rx")
_ROUNDED = 1e-12  # of the torques: less is rounding


@dataclass(frozen=True)
class GravityEstimate:
    """The gravity that is in torques.

    Attributes:
        vector: (3,) in the base's frame [m/s^2]; zero: none is.
        is_reversed: whether it is that written, in torques of the opposite sign.
    """

    vector: Array
    is_reversed: bool = False


def gravity_in(
    motion: ArmMotion, tau: Array, arm_under: ArmUnder, written: Array
) -> GravityEstimate | None:
    """Returns the gravity that is in torques, None if it is that written.

    The nominal weights under gravity along each axis of the base are fitted to the
    torques, with the rest of each joint's nominal torque at a positive scale of its
    own, and friction. There is none, if less than half of gravity is in the torques.
    Torques in another order or of other signs have no common gravity either: whatever
    is found has to explain more than half of them.

    Args:
        motion: at some rows.
        tau: (rows, joints) torques there.
        arm_under: gives the arm under a gravity.
        written: (3,) in the base's frame [m/s^2].
    """
    size = float(np.linalg.norm(written))
    columns, rest = _weights(motion, arm_under, size)
    by_written = columns @ (written[:, None] / size)
    scale = np.where(tau.std(axis=0) > 0.0, tau.std(axis=0), 1.0)
    if not tau.any() or np.abs(by_written).max() <= _ROUNDED * scale.max():
        return None
    fits = _Fits(tau, friction_columns(motion.dry_v), scale)
    share, error = fits.shares(columns, rest)
    length = float(np.linalg.norm(share))
    if length + STANDARD_ERRORS * error < 0.5:
        is_known = fits.explains(columns[..., :0], rest)
        is_none = is_known and not fits.has_weight(by_written, rest)
        return GravityEstimate(np.zeros(3)) if is_none else None
    if length <= STANDARD_ERRORS * error:
        return None
    tilt = _MOST_TILT + STANDARD_ERRORS * error / length
    losses = fits.losses(columns, rest)
    # What pulls up is not the gravity that is written.
    is_up = fits.shares(by_written, rest)[0][0] < 0.0
    bound = fits.losses(by_written[..., : 0 if is_up else 1], rest)
    if angle_between(share, written) < tilt or not is_lower(losses, bound):
        return None
    if not fits.explains(columns, rest):
        return None
    is_opposite = angle_between(share, -written) < tilt
    if is_opposite and not is_lower(losses, fits.losses(columns, -rest)):
        return GravityEstimate(written, True)
    return GravityEstimate(size * share / length)


@dataclass(frozen=True)
class _Fits:
    """Fits of weights, the rest of the nominal torques, and friction.

    Attributes:
        tau: (n, joints).
        friction: (n, joints, 3).
        scale: (joints,) of the torques.
    """

    tau: Array
    friction: Array
    scale: Array

    def losses(self, weights: Array, rest: Array) -> Array:
        """Returns held-out losses (blocks,) of weights (n, joints, k) and the rest."""
        grams, choice = self._grams(weights, rest)
        return np.asarray(grams.losses(choice, self.scale).sum(axis=1))

    def explains(self, weights: Array, rest: Array) -> bool:
        """Returns whether weights and the rest leave less than half of the torques."""
        losses = self.losses(weights, rest)
        return bool(losses.mean() < FAR_BETTER * self.tau.shape[1])

    def has_weight(self, weight: Array, rest: Array) -> bool:
        """Returns whether weights (n, joints), each of any scale, explain far more."""
        by_joint = weight * np.eye(self.tau.shape[1])
        left, lost = (self.losses(w, rest) for w in (by_joint, weight[..., :0]))
        return bool(left.sum() < FAR_BETTER * lost.sum())

    def shares(self, weights: Array, rest: Array) -> tuple[Array, float]:
        """Returns the scales (k,) of weights, and the error of their vector."""
        grams, choice = self._grams(weights, rest)
        without = grams.shared_by_block(choice, self.scale)
        error = jackknife_error(without) if len(without) > 1 else np.inf
        return without.mean(axis=0), error

    def _grams(self, weights: Array, rest: Array) -> tuple[ChannelGrams, Array]:
        offset, friction = self.friction[..., :1], self.friction[..., 1:]
        own = np.concatenate([offset, rest[..., None], friction], axis=-1)
        grams = ChannelGrams.of(weights, self.tau[..., None], own, positive=3)
        return grams, np.ones((self.tau.shape[1], 1))


def _weights(
    motion: ArmMotion, arm_under: ArmUnder, size: float
) -> tuple[Array, Array]:
    """Returns nominal torques of weight (n, joints, 3) by axis, and all others.

    Args:
        motion: at some rows.
        arm_under: gives the arm under a gravity.
        size: of gravity [m/s^2].
    """
    zero = np.zeros_like(motion.v)
    rest = arm_under(np.zeros(3)).torques(motion.q, motion.v, motion.vd)
    by_axis = [arm_under(g).torques(motion.q, zero, zero) for g in size * np.eye(3)]
    return np.stack(by_axis, axis=-1), rest


def friction_columns(v: Array) -> Array:
    """Returns columns (n, joints, 3): an offset, viscous and dry friction."""
    return np.stack([np.ones_like(v), v, np.sign(v)], axis=-1)
