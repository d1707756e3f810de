"""Integrates movement commands into a pose target, and that into coordinates."""

from collections.abc import Sequence

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiscreteValues,
    EventStatus,
    LeafSystem,
)

from drake_disasm.cell.coordinates import Coordinates
from drake_disasm.common.arrays import Array, namespace
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.rotations import Pose, rotation_matrices, rotation_vectors
from drake_disasm.common.spatial import pose_from_vector, pose_to_vector
from drake_disasm.common.stopwatch import Stopwatch
from drake_disasm.common.timing import MOTION_DELAY
from drake_disasm.effects import MotionEffect

#: For how many effects the pose target has room.
MOST_MOTION_EFFECTS = 6


class PoseTarget(LeafSystem):
    """Moves the commanded pose of the bolt by each action, at the MDP's period.

    At each period: X_GB <- X_GB moved by the action's translation and turned by
    its rotation vector (both in G, about Bo), counted from the last *command*;
    then the station's coordinates for it, by inverse kinematics. Effects on the
    motion act on the way from the command to those coordinates: `X_GB_commanded`
    knows nothing of them. In between, `velocity` leads from the last coordinates to
    the next in one period, so that an integrator behind it (Drake's, in C++) moves
    the station evenly.

    @system
    name: PoseTarget
    input_ports:
    - action
    - observation
    output_ports:
    - velocity
    - X_GB_commanded
    - action_executed
    @endsystem

    Attributes:
        stopwatch: what inverse kinematics takes.

    Args:
        coordinates: the station's coordinates.
        start: (n,) coordinates at which an episode starts.
        period: of the MDP [s].
        effects: that act by default, in the order of the chain.

    Raises:
        DisasmError: there are more effects than it can remember.
    """

    def __init__(
        self,
        coordinates: Coordinates,
        start: np.ndarray,
        period: float,
        effects: Sequence[MotionEffect] = (),
    ) -> None:
        super().__init__()
        _refuse_too_many(effects)
        self._coordinates, self._period = coordinates, period
        self.stopwatch = Stopwatch()
        self._action = self.DeclareVectorInputPort("action", 6)
        self._observation = self.DeclareVectorInputPort("observation", 12)
        self._effects = self.DeclareAbstractParameter(Value[object](tuple(effects)))
        self._memory = self.DeclareDiscreteState(6 * MOST_MOTION_EFFECTS)
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
        executed, memory = self._executed_pose(context, X_GB)
        state.set_value(self._memory, memory)
        state.set_value(self._from, near)
        with self.stopwatch:
            state.set_value(self._to, self._coordinates.solve(executed, near))
        state.set_value(self._pose, pose_to_vector(X_GB))
        state.set_value(self._executed, action)
        return EventStatus.Succeeded()

    def set_start(self, context: Context, start: np.ndarray) -> None:
        """Puts the coordinates (n,) at which an episode starts into a Context."""
        pose = pose_to_vector(self._coordinates.pose(start))
        context.SetDiscreteState(self._from, start)
        context.SetDiscreteState(self._to, start)
        context.SetDiscreteState(self._pose, pose)

    def set_effects(self, context: Context, effects: Sequence[MotionEffect]) -> None:
        """Puts effects, in the order of the chain, into this system's Context.

        Raises:
            DisasmError: there are more than it has state for.
        """
        _refuse_too_many(effects)
        parameter = context.get_mutable_abstract_parameter(self._effects)
        parameter.set_value(tuple(effects))

    def _executed_pose(
        self, context: Context, X_GB: RigidTransform
    ) -> tuple[RigidTransform, np.ndarray]:
        """Returns where a command leads, and what the effects remember."""
        effects = context.get_abstract_parameter(self._effects).get_value()
        memory = context.get_discrete_state(self._memory).value()
        if not effects:
            return X_GB, memory
        wrench, commanded = self._observation.Eval(context)[6:], Pose.of(X_GB)
        executed, memories = executed_pose(
            effects, commanded, wrench, memory.reshape(-1, 6), self._period
        )
        return executed.to_drake(), memories.reshape(-1)

    def _calc_velocity(self, context: Context, output: BasicVector) -> None:
        way = (
            context.get_discrete_state(self._to).value()
            - context.get_discrete_state(self._from).value()
        )
        output.SetFromVector(way / self._period)


def _refuse_too_many(effects: Sequence[MotionEffect]) -> None:
    if len(effects) > MOST_MOTION_EFFECTS:
        raise DisasmError(
            f"effects: {len(effects)} act on the motion, {MOST_MOTION_EFFECTS} "
            "at most can; take some out"
        )


def through_motion(
    effects: Sequence[MotionEffect],
    commanded: Array,
    wrench: Array,
    memories: Array,
    period: float,
) -> tuple[Array, Array]:
    """Returns what is executed (..., 6) of a command, and what effects remember.

    Args:
        effects: in the order of the chain.
        commanded: (..., 6) position and rotation vector of B in G [m, rad].
        wrench: (..., 6) [f; tau] on the bolt at Bo in G, at the step's beginning.
        memories: (..., k, 6) of the step before, one for each effect and maybe more.
        period: of the MDP [s].
    """
    memories = namespace(memories).asarray(memories, copy=True)
    for i, effect in enumerate(effects):
        commanded, memories[..., i, :] = effect.execute(
            commanded, wrench, memories[..., i, :], period
        )
    return commanded, memories


def executed_pose(
    effects: Sequence[MotionEffect],
    X_GB: Pose,
    wrench: Array,
    memories: Array,
    period: float,
) -> tuple[Pose, Array]:
    """Returns where a commanded pose leads, and what effects remember.

    See `through_motion`. What the effects leave as it is stays so, bit for bit.
    """
    xp = namespace(X_GB.p)
    commanded = xp.concat([X_GB.p, rotation_vectors(X_GB.R)], axis=-1)
    executed, memories = through_motion(effects, commanded, wrench, memories, period)
    is_same = xp.all(executed == commanded, axis=-1)
    R = rotation_matrices(executed[..., 3:])
    return (
        Pose(
            xp.where(is_same[..., None, None], X_GB.R, R),
            xp.where(is_same[..., None], X_GB.p, executed[..., :3]),
        ),
        memories,
    )


def moved(X_GB: RigidTransform, action: np.ndarray) -> RigidTransform:
    """Returns the pose after an action (6,) [m, rad], both in G, about Bo."""
    return moved_poses(Pose.of(X_GB), action).to_drake()


def moved_poses(X_GB: Pose, action: Array) -> Pose:
    """Returns poses after actions (..., 6) [m, rad], both in G, about Bo."""
    R = namespace(action).matmul(rotation_matrices(action[..., 3:]), X_GB.R)
    return Pose(R, X_GB.p + action[..., :3])
