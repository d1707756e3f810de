"""In which order, and with which signs, torques explain an arm's motion.

Which joint a column of torques belongs to is an assignment problem: each joint's
nominal torque and friction explain each column more or less, and an order is as likely
as its columns are together. There are many orders, and some would fit by chance: one is
taken only if it beats all that are as simple, by more than the number of orders allows.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from sysid.models.channel_grams import (
    BY_CHANCE,
    FAR_BETTER,
    ChannelGrams,
    is_replicated,
    runs_of,
)
from sysid.models.signed_order import SignedOrder

Array = NDArray[np.float64]

_SIGNS = (1.0, -1.0)
_ROUNDED = 1e-12  # of a column's variance: less is rounding


@dataclass(frozen=True)
class TorqueOrder:
    """How well each joint explains each column of torques.

    Attributes:
        losses: (blocks, joints, columns, 2) held out, as shares of the columns'
            variance; of columns as they are, and with the other sign.
        runs: (columns,) see `runs_of`: how much each column says.
    """

    losses: Array
    runs: Array

    @classmethod
    def of(cls, nominal: Array, friction: Array, tau: Array) -> Self:
        """Fits each joint's nominal torque and friction to each column.

        Neither may be negative: a joint's friction takes power, and its weight pulls
        down.

        Args:
            nominal: (rows, joints) torques of the nominal bodies.
            friction: (rows, joints, 3) columns, of which the first is an offset.
            tau: (rows, joints) as written.
        """
        joints = tau.shape[1]
        scale = tau.std(axis=0)
        scale = np.where(scale > 0.0, scale, 1.0)
        nothing = np.zeros((len(tau), joints, 0))
        by_joint = []
        for i in range(joints):
            own = np.column_stack([friction[:, i], nominal[:, i]])
            columns = np.repeat(own[:, None], joints, axis=1)
            grams = ChannelGrams.of(nothing, tau[:, :, None], columns, positive=3)
            by_joint.append(
                [grams.losses(np.full((joints, 1), sign), scale) for sign in _SIGNS]
            )
        losses = np.transpose(by_joint, (2, 0, 3, 1)) + _ROUNDED
        return cls(losses, runs_of(tau))

    def found(self) -> SignedOrder:
        """Returns the order that explains the torques; as written if none is known.

        An order is as likely as exp(-sum(runs / 2 log(loss))). Of those that are about
        as likely as the likeliest, the simplest is taken: that written, or one slip
        away from it, or any. None is, if another that is as simple might as well be.
        """
        written = SignedOrder.as_written(len(self.runs))
        best = self._likeliest
        rank = dict.fromkeys((best, *best.near()), 2)
        rank |= dict.fromkeys(written.simple(), 1) | {written: 0}
        behind = {each: self._surprise(each) - self._surprise(best) for each in rank}
        lost = {each: self._lost(each).sum() for each in rank}
        least = -math.log(FAR_BETTER) + lost[best]
        is_open = {o for o in rank if behind[o] < self._odds or lost[o] < least}
        likely = [each for each in rank if behind[each] < -math.log(BY_CHANCE)]
        found = min(likely, key=lambda each: rank[each])
        rivals = {each for each in is_open if rank[each] <= rank[found]}
        if found == written or rivals != {found}:
            return written
        explains = self._lost(found)[found.moved].mean() < math.log(FAR_BETTER)
        by_block = [np.log(self._of(each)).sum(axis=1) for each in (found, written)]
        return found if explains and is_replicated(*by_block) else written

    @property
    def _odds(self) -> float:
        """Logarithm of how many orders and signs there are, for one chance of all."""
        joints = len(self.runs)
        return math.lgamma(joints + 1) + joints * math.log(2.0) - math.log(BY_CHANCE)

    @cached_property
    def _likeliest(self) -> SignedOrder:
        losses = np.log(self.losses.mean(axis=0)) * self.runs[:, None]
        joints, columns = linear_sum_assignment(losses.min(axis=2))
        signs = np.array(_SIGNS)[losses.argmin(axis=2)[joints, columns]]
        return SignedOrder(tuple(columns.tolist()), tuple(signs.tolist()))

    def _of(self, order: SignedOrder) -> Array:
        """Returns the losses (blocks, joints) of an order."""
        joints = np.arange(len(self.runs))
        at = (np.array(order.sign) < 0.0).astype(int)
        return self.losses[:, joints, list(order.order), at]

    def _lost(self, order: SignedOrder) -> Array:
        """Returns the logarithm of the loss of each joint (joints,)."""
        return np.asarray(np.log(self._of(order).mean(axis=0)))

    def _surprise(self, order: SignedOrder) -> float:
        """Returns the negative logarithm of an order's likelihood."""
        return float(0.5 * self.runs[list(order.order)] @ self._lost(order))
