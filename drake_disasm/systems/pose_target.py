"""Integrates movement commands into a pose target, and that into coordinates."""

import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiscreteValues,
    EventStatus,
    LeafSystem,
)

from drake_disasm.coordinates import Coordinates
from drake_disasm.spatial import (
    pose_from_vector,
    pose_to_vector,
    rotation_from_vector,
)
from drake_disasm.timing import MOTION_DELAY


class PoseTarget(LeafSystem):
    """Moves the commanded pose of the bolt by each action, at the MDP's period.

    At each period: X_GB <- X_GB moved by the action's translation and turned by
    its rotation vector (both in G, about Bo), counted from the last *command*;
    then the station's coordinates for it, by inverse kinematics. In between,
    `velocity` leads from the last coordinates to the next in one period, so that
    an integrator behind it (Drake's, in C++) moves the station evenly.

    @system
    name: PoseTarget
    input_ports:
    - action
    output_ports:
    - velocity
    - X_GB_commanded
    - action_executed
    @endsystem

    Args:
        coordinates: the station's coordinates.
        start: (n,) coordinates at which an episode starts.
        period: of the MDP [s].
    """

    def __init__(
        self, coordinates: Coordinates, start: np.ndarray, period: float
    ) -> None:
        super().__init__()
        self._coordinates, self._period = coordinates, period
        self._action = self.DeclareVectorInputPort("action", 6)
        pose = pose_to_vector(coordinates.pose(start))
        self._from = self.DeclareDiscreteState(start)
        self._to = self.DeclareDiscreteState(start)
        self._pose = self.DeclareDiscreteState(pose)
        self._executed = self.DeclareDiscreteState(6)
        self.DeclarePeriodicDiscreteUpdateEvent(period, MOTION_DELAY, self._update)
        ticket = {self.xd_ticket()}
        self.DeclareVectorOutputPort(
            "velocity", len(start), self._calc_velocity, prerequisites_of_calc=ticket
        )
        self.DeclareStateOutputPort("X_GB_commanded", self._pose)
        self.DeclareStateOutputPort("action_executed", self._executed)

    def _update(self, context: Context, state: DiscreteValues) -> EventStatus:
        action = self._action.Eval(context)
        near = context.get_discrete_state(self._to).value()
        X_GB = moved(
            pose_from_vector(context.get_discrete_state(self._pose).value()), action
        )
        state.set_value(self._from, near)
        state.set_value(self._to, self._coordinates.solve(X_GB, near))
        state.set_value(self._pose, pose_to_vector(X_GB))
        state.set_value(self._executed, action)
        return EventStatus.Succeeded()

    def _calc_velocity(self, context: Context, output: BasicVector) -> None:
        way = (
            context.get_discrete_state(self._to).value()
            - context.get_discrete_state(self._from).value()
        )
        output.SetFromVector(way / self._period)


def moved(X_GB: RigidTransform, action: np.ndarray) -> RigidTransform:
    """Returns the pose after an action (6,) [m, rad], both in G, about Bo."""
    R = rotation_from_vector(action[3:]) @ X_GB.rotation()
    return RigidTransform(R, X_GB.translation() + action[:3])
