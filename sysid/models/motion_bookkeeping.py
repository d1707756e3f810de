"""Estimates of how the torques of an arm were written: order, signs, clocks, gravity.

All compare rigid bodies with free inertial parameters, and an offset, dry and viscous
friction at each joint, with the torques as they are and as they might have been. Dry
and viscous friction may only take power: without that, a torque of the wrong sign would
be explained by friction that drives the joint.
"""

import itertools
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from sysid.models.arm_motion import ArmMotion
from sysid.models.channel_grams import (
    FAR_BETTER,
    MOST_BLOCKS,
    ChannelGrams,
    Estimate,
    is_beyond_chance,
    is_replicated,
    jackknife_error,
    parts_of,
    runs_of,
)
from sysid.models.gravity_estimate import (
    ArmUnder,
    GravityEstimate,
    friction_columns,
    gravity_in,
)
from sysid.models.signed_order import SignedOrder
from sysid.models.torque_order import TorqueOrder

Array = NDArray[np.float64]

_MOST_ROWS = 2500  # that are looked at, evenly spread: bodies have some 50 parameters
_FEW_ROWS = 300  # at which an arm that stands otherwise is evaluated
_THOUSAND = 1000.0
_LATEST, _STEP = 0.1, 0.005  # s; delays that are tried, and their spacing
_FINE = 10  # steps of the second scan in one of the first


class TorqueFits:
    """Fits of an arm's motion to its torques, written one way or another.

    Args:
        motion: at all rows.
        tau: (rows, joints) as written [N m or N].
    """

    def __init__(self, motion: ArmMotion, tau: Array) -> None:
        self._motion, self._tau = motion, tau
        self._taken = spread_rows(len(tau), _MOST_ROWS)
        self._thin = motion.rows(self._taken)
        self._scale = _positive(tau[self._taken].std(axis=0))
        self._friction = friction_columns(self._thin.dry_v)

    @property
    def are_known(self) -> bool:
        """Whether each block has as many torques as the fits have coefficients."""
        rows, joints, bodies = self._thin.Y.shape
        coefficients = bodies + joints * self._friction.shape[2]
        return bool(rows >= MOST_BLOCKS * coefficients / joints)

    def signed_order(self) -> SignedOrder:
        """Returns the order and signs of torques that explain them, see TorqueOrder.

        Bodies with free parameters have to agree with the nominal ones: where the base
        is mounted otherwise, friction tells the sign.
        """
        tau = self._tau[self._taken]
        nominal = self._thin.Y @ self._thin.nominal
        found = TorqueOrder.of(nominal, self._friction, tau).found()
        written = SignedOrder.as_written(tau.shape[1])
        if found == written:
            return written
        grams = self._grams(np.repeat(tau[:, None, :], tau.shape[1], axis=1))
        losses = [
            grams.losses(each.matrix, self._scale[list(each.order)]).sum(axis=1)
            for each in (found, written)
        ]
        return found if is_replicated(*losses) else written

    def torque_units(self) -> dict[int, float]:
        """Returns joints whose torque has another unit, with the factor to divide by.

        The unit of one joint shows by the bodies that it shares with others; of which,
        by the size of the nominal torques.
        """
        tau = self._tau[self._taken]
        nominal = (self._thin.Y @ self._thin.nominal).std(axis=0)
        grams = self._grams(tau[..., None])
        ones = np.ones_like(self._scale)
        found = {}
        for i, factor in itertools.product(
            range(len(ones)), (_THOUSAND, 1 / _THOUSAND)
        ):
            size = np.log(self._scale[i] / _positive(nominal)[i])
            if abs(size - np.log(factor)) > abs(size):
                continue
            by = np.where(np.arange(len(ones)) == i, factor, 1.0)
            one, other = (
                grams.losses((1.0 / each)[:, None], self._scale / each)
                for each in (by, ones)
            )
            explains = one[:, i].mean() < FAR_BETTER
            if explains and is_replicated(
                one.sum(axis=1), FAR_BETTER * other.sum(axis=1)
            ):
                found[i] = factor
        return found

    def exchanged_motions(
        self, regressor: Callable[[Array, Array, Array], Array], most: float
    ) -> tuple[tuple[int, int], float] | None:
        """Returns the two joints whose motions are exchanged, and the error's share.

        None if no exchange leaves less than a share of the error. Bodies and friction
        are free, as everywhere here; a regressor is made for every two joints, so that
        few rows are looked at.

        Args:
            regressor: of the arm, (rows, joints, b) for q, v and vd.
            most: share of the error that an exchange may leave.
        """
        rows = spread_rows(len(self._thin.time), _FEW_ROWS)
        thin, tau = self._thin.rows(rows), self._tau[self._taken][rows]
        joints, lost = tau.shape[1], {}
        for pair in itertools.combinations(range(joints), 2):
            order = list(SignedOrder.as_written(joints).exchanged(*pair).order)
            q, v, vd, dry_v = (
                x[:, order] for x in (thin.q, thin.v, thin.vd, thin.dry_v)
            )
            own = friction_columns(dry_v)
            lost[pair] = self._error(regressor(q, v, vd), own, tau)
        if not lost:
            return None
        written = self._error(
            regressor(thin.q, thin.v, thin.vd), friction_columns(thin.dry_v), tau
        )
        best = min(lost, key=lambda pair: lost[pair])
        share = lost[best] / max(written, 1e-300)
        return (best, share) if share <= most else None

    def _error(self, Y: Array, friction: Array, tau: Array) -> float:
        """Returns the rms error, held out, of torques (rows, joints) in their scale."""
        grams = ChannelGrams.of(Y, tau[..., None], friction, positive=2)
        ones = np.ones((tau.shape[1], 1))
        return float(np.sqrt(grams.losses(ones, self._scale).sum(axis=1).mean()))

    def lost(self, delay: float = 0.0) -> float:
        """Returns what is left of torques that are late [s], to compare ways by."""
        return float(self._delayed(np.array([delay])).sum())

    def common_delay(self) -> Estimate | None:
        """Returns by how much all torques are late [s]; None if they are not.

        The delay with the least sum of the logarithms of all joints' losses: each
        joint counts by how sharply its torque tells the delay. Most joints and all but
        one part of the log have to ask for it by themselves, within half of it: what
        single joints do, or do for a while, is another matter. Each joint's torque has
        to be explained, or what else is wrong with it would be taken for a delay.
        """
        count = round(_LATEST / _STEP)
        coarse = np.linspace(-_LATEST, _LATEST, 2 * count + 1)
        rough = self._delayed(coarse)
        near = coarse[int(np.argmin(_log_sum(rough)))]
        fine: Array = near + _STEP * np.arange(-_FINE, _FINE + 1) / _FINE
        curve, written = self._delayed(fine), rough[count]
        found = Estimate(_least_at(fine, curve), _delay_error(fine, curve))
        best = curve[int(np.argmin(_log_sum(curve)))].mean(axis=0)
        tried, runs = np.log(len(coarse)), runs_of(self._tau)
        is_told = is_beyond_chance(best, written.mean(axis=0), runs, tried)
        is_told = is_told and best.max() < FAR_BETTER
        is_inside = abs(near) < coarse[-1]
        is_late = is_inside and is_told and found.is_off(0.0)
        return found if is_late and _is_common(found.value, coarse, rough) else None

    def gravity(self, arm_under: ArmUnder, written: Array) -> GravityEstimate | None:
        """Returns the gravity that is in the torques, None if it is that written.

        Args:
            arm_under: gives the arm under a gravity.
            written: (3,) in the base's frame [m/s^2].
        """
        few = spread_rows(len(self._thin.time), _FEW_ROWS)
        thin, tau = self._thin.rows(few), self._tau[self._taken][few]
        return gravity_in(thin, tau, arm_under, written)

    def _delayed(self, delays: Array) -> Array:
        """Returns held-out losses (delays, blocks, joints) of torques shifted back.

        Of smoothed ones: between samples a spline averages noise, which would speak for
        any delay that is no multiple of the period.
        """
        motion, joints = self._motion, self._tau.shape[1]
        targets = np.empty((len(self._thin.time), joints, len(delays)))
        for number in np.unique(motion.episode):
            rows, own = motion.episode == number, self._thin.episode == number
            time, at = motion.time[rows], self._thin.time[own]
            if len(time) < 2:
                targets[own] = self._tau[rows][:, :, None]
                continue
            read = CubicSpline(time, _smooth(self._tau[rows]))
            shifted = np.clip(at[:, None] + delays, time[0], time[-1])
            targets[own] = np.swapaxes(read(shifted), 1, 2)
        grams = self._grams(targets)
        choices = np.eye(len(delays))
        return np.array(
            [
                grams.losses(np.tile(choice, (joints, 1)), self._scale)
                for choice in choices
            ]
        )

    def _grams(self, targets: Array) -> ChannelGrams:
        return ChannelGrams.of(self._thin.Y, targets, self._friction, positive=2)


def _smooth(values: Array) -> Array:
    """Returns values (n, k) without what changes from sample to sample.

    By binomial weights, which shift nothing.
    """
    padded = np.pad(values, ((2, 2), (0, 0)), mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, 5, axis=0)
    return np.asarray(windows @ (np.array([1.0, 4.0, 6.0, 4.0, 1.0]) / 16.0))


def _log_sum(curve: Array) -> Array:
    """Returns the sum of the logarithms of joints' losses (..., blocks, joints)."""
    return np.asarray(np.log(curve.sum(axis=-2) + 1e-300).sum(axis=-1))


def _is_common(late: float, delays: Array, curve: Array) -> bool:
    """Returns whether parts of a log, and joints, tell about the same delay [s]."""
    blocks = range(curve.shape[1])
    parts = [_least_at(delays, curve[:, own]) for own in parts_of(blocks)]
    joints = [_least_at(delays, curve[..., [i]]) for i in range(curve.shape[2])]
    by_part, by_joint = (
        np.abs(np.array(each) - late) <= 0.5 * abs(late) for each in (parts, joints)
    )
    return bool(np.sum(~by_part) <= 1 and by_joint.mean() > 0.5)


def _least_at(delays: Array, curve: Array) -> float:
    """Returns where the losses are least, by a parabola through three points."""
    lost = _log_sum(curve)
    k = int(np.clip(np.argmin(lost), 1, len(delays) - 2))
    quadratic = np.polyfit(delays[k - 1 : k + 2] - delays[k], lost[k - 1 : k + 2], 2)
    if quadratic[0] <= 0.0:
        return float(delays[int(np.argmin(lost))])
    least = delays[k] - quadratic[1] / (2.0 * quadratic[0])
    return float(np.clip(least, delays[0], delays[-1]))


def _delay_error(delays: Array, curve: Array) -> float:
    """Returns the standard error of a delay, over blocks."""
    blocks = range(curve.shape[1])
    if len(blocks) < 2:
        return np.inf
    return jackknife_error(
        [_least_at(delays, np.delete(curve, k, axis=1)) for k in blocks]
    )


def spread_rows(rows: int, most: int) -> NDArray[np.bool_]:
    """Returns which rows (rows,) are looked at: at most so many, evenly spread."""
    return np.arange(rows) % max(1, -(-rows // most)) == 0


def _positive(scale: Array) -> Array:
    return np.where(scale > 0.0, scale, 1.0)
