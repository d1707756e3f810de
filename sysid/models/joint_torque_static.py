"""An arm's joint torques at rest: gravity, and what holds the joints besides."""

import dataclasses
from collections.abc import Iterator, Sequence
from typing import Self

import numpy as np
from numpy.typing import NDArray

from drake_disasm.effects import (
    ArmEffect,
    DelayEffect,
    EncoderError,
    JointAsymmetricFriction,
    JointCoupling,
    JointElasticity,
    JointMemoryEffect,
    JointStribeckFriction,
    JointViscousFriction,
    RotorInertia,
)
from drake_disasm.logs import Log
from drake_disasm.scenario import Scenario
from sysid.models.arm_motion import ArmMotion
from sysid.models.base import Array
from sysid.models.bookkeeping import Bookkeeping, Poses
from sysid.models.joint_motion import JointMotionModel, Motion
from sysid.models.motion_bookkeeping import TorqueFits
from sysid.models.regressor import ArmRegressor, BaseSet, base_set

#: rad or m: less is noise of an encoder that nobody moved, and before as much dry
#: friction has not turned: a contact yields before it slides (JointDahlFriction).
_LEAST_MOVE = 2e-3
#: rad/s at which a joint is said to have come: no friction creeps so fast.
_ARRIVAL = 10.0
#: Effects that need motion, or a path: at rest they are nothing.
_OF_MOTION = (
    JointViscousFriction,
    JointStribeckFriction,
    JointAsymmetricFriction,
    JointMemoryEffect,
    JointCoupling,
    RotorInertia,
    DelayEffect,
)


class JointTorqueStaticModel(JointMotionModel):
    """tau = Y(q, 0, 0) beta, with beta the base parameters that gravity shows.

    They are masses and first moments, combined; inertias are not asked for. Effects are
    those that show at rest. Dry friction c holds a joint anywhere in [-c, c] about the
    rest. What is known of it is from which side the joint came, so that it is taken for
    c sign(q - q_before), at best: after a creep back, or where the controller settles
    from the other side, it is less or has the other sign. Of a joint that has not moved
    since the pose before, and in an episode's first pose, the sign is unknown, and
    taken for zero. Poses that are reached from both sides show it: the mean of the two
    torques is gravity, half their difference friction (as Lin et al. 2019 record them,
    "A reliable gravity compensation control strategy for dVRK robotic arms with
    nonlinear disturbance forces").
    """

    kind = "joint_torque_static"
    setting = "rest"
    residual_effect = None
    shown_elsewhere = (*_OF_MOTION, JointElasticity, EncoderError)
    of_base = "not a base parameter of this arm at rest, which shows no inertias"

    def __init__(
        self,
        logs: Sequence[Log],
        urdf: str | None = None,
        scenario: Scenario | None = None,
    ) -> None:
        """See JointMotionModel; of logs of torques at rest."""
        super().__init__(logs, urdf, scenario)
        self._has_time = all("time" in e for log in logs for e in log.episodes)

    @property
    def poses(self) -> Poses | None:
        """See LogModel; None where only an order is known, and no time."""
        return Poses(self._motion.time, self._turned_by) if self._has_time else None

    def _turned_by(self, rows: NDArray[np.int64], others: NDArray[np.int64]) -> Array:
        """Returns by how much some joint differs (n,) between rows [rad or m]."""
        q = self._motion.q
        return np.asarray(np.abs(q[rows] - q[others]).max(axis=1))

    def covariates(self, channel: int) -> dict[str, Array]:
        """See LogModel: where the joint is, and from which side it came."""
        side = np.sign(self._motion.dry_v[:, channel])
        return {"position": self._motion.q[:, channel], "direction of arrival": side}

    @staticmethod
    def _motions(logs: Sequence[Log]) -> Sequence[Motion]:
        """See JointMotionModel; nothing moves, and an order stands in for times."""
        return [
            {
                "time": episode["time" if "time" in episode else "order"],
                "q": episode["q"],
                "tau": episode["tau"],
                **dict.fromkeys(("v", "vd"), np.zeros_like(episode["q"])),
            }
            for log in logs
            for episode in log.episodes
        ]

    @staticmethod
    def _base_set(arm: ArmRegressor) -> BaseSet:
        """See JointMotionModel."""
        return base_set(arm.random_regressor(at_rest=True))

    @staticmethod
    def _motion_of(
        arm: ArmRegressor,
        base: BaseSet,
        joints: Sequence[str],
        motions: Sequence[Motion],
    ) -> ArmMotion:
        """See JointMotionModel."""
        came = np.concatenate([arrivals(each["q"]) for each in motions])
        found = ArmMotion.of(arm, base, joints, motions)
        return dataclasses.replace(found, dry_v=_ARRIVAL * came)

    def _on_arm(self, theta: Array) -> list[ArmEffect]:
        on_arm = super()._on_arm(theta)
        return [e for e in on_arm if not isinstance(e, _OF_MOTION)]

    def _wrong_rates(self) -> list[Bookkeeping[Self]]:
        return []

    def _late(self, fits: TorqueFits) -> Iterator[tuple[Bookkeeping[Self], float]]:
        yield from ()


def arrivals(q: Array) -> Array:
    """Returns in which direction each joint came to where it is (n, joints): -1, 0, 1.

    Rows in which no joint has moved are readings of one pose, and have one direction.

    Args:
        q: (n, joints) positions at rest of an episode, in their order.
    """
    found, pose = np.zeros_like(q), 0
    for row in range(1, len(q)):
        step = q[row] - q[pose]
        has_moved = np.abs(step) > _LEAST_MOVE
        found[row] = found[pose]
        if has_moved.any():
            found[row], pose = np.sign(step) * has_moved, row
    return found
