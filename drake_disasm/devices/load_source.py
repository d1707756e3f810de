"""Where the load on a simulated sensor comes from: a joint's reaction, or the arm."""

import abc
from collections.abc import Callable

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.tree import Frame, Joint
from pydrake.systems.framework import (
    Context,
    DependencyTicket,
    EventStatus,
    LeafSystem,
    State,
)

from drake_disasm.cell.arm_wrench import ArmWrench
from drake_disasm.common.spatial import shift_and_express, wrench_from_spatial_force


class LoadSource(abc.ABC):
    """Input ports of a sensor, and the load on it that they tell."""

    @abc.abstractmethod
    def declare(self, sensor: LeafSystem) -> set[DependencyTicket]:
        """Declares the ports; returns what the load depends on."""

    @abc.abstractmethod
    def load(self, context: Context) -> np.ndarray:
        """Returns the load (6,), [f; tau] at So in S; zeros before the first step."""

    @abc.abstractmethod
    def R_WS(self, context: Context) -> np.ndarray:
        """Returns the sensor's orientation in the world (3, 3)."""


class JointReaction(LoadSource):
    """The reaction of a joint whose child frame is S, the other way round.

    Args:
        joint: whose reaction is read.
        frame_S: its child frame.
        mount: X_WS of (6,) coordinates, for a sensor that is elsewhere than the joint's
            child frame: a massless spring between them transmits the load.
    """

    def __init__(
        self,
        joint: Joint,
        frame_S: Frame,
        mount: Callable[[np.ndarray], RigidTransform] | None = None,
    ) -> None:
        # Reactions are in the order of the joints, of which some may be removed.
        self._joint = joint.GetParentPlant().GetJointIndices().index(joint.index())
        self._body = int(frame_S.body().index())
        self._X_BodyS, self._mount = frame_S.GetFixedPoseInBodyFrame(), mount

    def declare(self, sensor: LeafSystem) -> set[DependencyTicket]:
        """See LoadSource."""
        self._reaction = sensor.DeclareAbstractInputPort(
            "reaction_forces", Value[list[SpatialForce]]()
        )
        self._poses = sensor.DeclareAbstractInputPort(
            "body_poses", Value[list[RigidTransform]]()
        )
        tickets = {self._reaction.ticket(), self._poses.ticket()}
        if self._mount:
            self._coordinates = sensor.DeclareVectorInputPort("mount_coordinates", 6)
            tickets.add(self._coordinates.ticket())
        return tickets

    def load(self, context: Context) -> np.ndarray:
        """See LoadSource."""
        load = -wrench_from_spatial_force(self._reaction.Eval(context)[self._joint])
        if not self._mount or not load.any():
            return load
        X_WJc = self._X_WJc(context)
        return shift_and_express(load, self._X_WS(context).inverse() @ X_WJc)

    def R_WS(self, context: Context) -> np.ndarray:
        """See LoadSource."""
        return np.asarray(self._X_WS(context).rotation().matrix())

    def _X_WJc(self, context: Context) -> RigidTransform:
        """Returns the pose of the joint's child frame."""
        return self._poses.Eval(context)[self._body] @ self._X_BodyS

    def _X_WS(self, context: Context) -> RigidTransform:
        if self._mount:
            return self._mount(self._coordinates.Eval(context))
        return self._X_WJc(context)


class JointTorques(LoadSource):
    """What an arm estimates from its joints' torques; S is its flange.

    Accelerations are differences of velocities between two steps.

    Args:
        arm: by whose model it estimates.
        joints: how many it has.
        time_step: of the plant that moves it [s].
    """

    def __init__(self, arm: ArmWrench, joints: int, time_step: float) -> None:
        self._arm, self._joints, self._h = arm, joints, time_step

    def declare(self, sensor: LeafSystem) -> set[DependencyTicket]:
        """See LoadSource."""
        n = self._joints
        self._ports = [
            sensor.DeclareVectorInputPort(name, n)
            for name in ("position", "velocity", "torque")
        ]
        self._before = sensor.DeclareDiscreteState(n)  # velocities
        # Unrestricted, as the plant's own update: a discrete one would come after it.
        sensor.DeclarePeriodicUnrestrictedUpdateEvent(self._h, 0.0, self._remember)
        return {port.ticket() for port in self._ports} | {sensor.xd_ticket()}

    def load(self, context: Context) -> np.ndarray:
        """See LoadSource."""
        q, v, torque = (port.Eval(context) for port in self._ports)
        a = (v - context.get_discrete_state(self._before).value()) / self._h
        return self._arm.load(q, v, a, torque) if torque.any() else np.zeros(6)

    def R_WS(self, context: Context) -> np.ndarray:
        """See LoadSource."""
        return self._arm.R_WF(self._ports[0].Eval(context))

    def _remember(self, context: Context, state: State) -> EventStatus:
        before = state.get_mutable_discrete_state(self._before)
        before.SetFromVector(self._ports[1].Eval(context))
        return EventStatus.Succeeded()
