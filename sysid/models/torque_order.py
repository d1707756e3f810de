"""In which order, and with which signs, torques explain an arm's motion.

Which joint a column of torques belongs to is an assignment problem: each joint's nominal
torque and friction explain each column more or less, and a whole order is as likely as
its columns are together. There are many orders, and some would fit by chance: one is
taken only if it beats all that are as simple, by more than the number of orders allows.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from sysid.models.channel_grams import FAR_BETTER, ChannelGrams, is_replicated
from sysid.models.signed_order import SignedOrder

Array = NDArray[np.float64]

_BY_CHANCE = 0.01  # how often an order may be taken that is none
_SIGNS = (1.0, -1.0)
_ROUNDED = 1e-12  # of a column's variance: less is rounding


@dataclass(frozen=True)
class TorqueOrder:
    """How well each joint explains each column of torques.

    Attributes:
        losses: (blocks, joints, columns, 2) held out, as shares of the columns'
            variance; of columns as they are, and with the other sign.
        runs: (columns,) how often each stays on one side of its mean. A log that
            swings twice says as much as so few numbers, however many rows it has.
    """

    losses: Array
    runs: Array

    @classmethod
    def of(cls, nominal: Array, friction: Array, tau: Array) -> "TorqueOrder":
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
        above = tau > tau.mean(axis=0)
        runs = 1.0 + np.sum(above[1:] != above[:-1], axis=0)
        return cls(np.transpose(by_joint, (2, 0, 3, 1)) + _ROUNDED, runs)

    def found(self) -> SignedOrder:
        """Returns the order that explains the torques; as written if none is known.

        An order and signs are as likely as exp(-sum of runs / 2 log loss). The simplest
        is taken of those that about the likeliest leave open, if no other that is as
        simple comes near.
        """
        written = SignedOrder.as_written(len(self.runs))
        best = self._likeliest
        rank = {each: 2 for each in (best, *best.near())}
        rank |= {each: 1 for each in written.simple()} | {written: 0}
        least, lost = self._surprise(best), self._lost(best).sum()
        open_ = {
            each: self._surprise(each) - least
            for each in rank
            if self._surprise(each) - least < self._odds
            or self._lost(each).sum() - lost < -math.log(FAR_BETTER)
        }
        likely = [each for each, by in open_.items() if by < -math.log(_BY_CHANCE)]
        found = min(likely, key=lambda each: rank[each])
        if sum(rank[each] <= rank[found] for each in open_) > 1 or found == written:
            return written
        explains = self._lost(found)[found.moved].mean() < math.log(FAR_BETTER)
        by_block = [
            np.log(self._of(each)).sum(axis=1) for each in (found, written)
        ]
        return found if explains and is_replicated(*by_block) else written

    @property
    def _odds(self) -> float:
        """Logarithm of how many orders and signs there are, for one chance of all."""
        joints = len(self.runs)
        return math.lgamma(joints + 1) + joints * math.log(2.0) - math.log(_BY_CHANCE)

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
        """Returns the negative logarithm of an order's likelihood, but for a constant."""
        return float(0.5 * self.runs[list(order.order)] @ self._lost(order))
