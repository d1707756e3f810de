"""Identified effects around a user's plant: what no robot's file holds.

Effects that move the arm become generalized forces on the plant's joints. Effects of
who reads the arm, its encoders and torque sensors and their delays, are in a system
whose outputs are what is read.
"""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    JacobianWrtVariable,
    ModelInstanceIndex,
    MultibodyForces,
)
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiagramBuilder,
    DiscreteValues,
    LeafSystem,
    OutputPort,
)
from pydrake.systems.primitives import ZeroOrderHold

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.quantity import closest
from drake_disasm.effects import (
    ArmEffect,
    ArmSamples,
    ArmTilt,
    ArmTorqueEffect,
    DelayEffect,
    EncoderError,
    FlangePayload,
    JointMemoryEffect,
    JointViscousFriction,
    RotorInertia,
)
from drake_disasm.scenario import Scenario
from sysid.effect_selection.close_loop import ClosedLoop
from sysid.export.identified_arm import IdentifiedArm

Array = NDArray[np.float64]

_PERIOD = 1e-3  # s, of a continuous plant's memories and delays
_SAME = 1e-6  # of a rotor's inertia


@dataclass(frozen=True)
class IdentifiedEffects:
    """The systems that were added.

    Attributes:
        torques: of the effects that move the arm.
        position, velocity, torque: (joints,) as they are read, in the order of
            `joints`.
        joints: names of the plant's driven joints.
    """

    torques: "JointEffectTorques"
    position: OutputPort
    velocity: OutputPort
    torque: OutputPort
    joints: tuple[str, ...]


def add_identified_effects(
    builder: DiagramBuilder, plant: MultibodyPlant, closed: ClosedLoop | Scenario
) -> IdentifiedEffects:
    """Adds the identified effects that a plant of an exported file does not simulate.

    Bodies, payload and rotors are the file's. Of damping, what the plant's joints have
    is not added again. A force acts on the joints that depends on their velocity
    steeply: c / e for dry friction c that creeps at e. The plant has to be continuous,
    or its time step below 2 m e / c, with m the least inertia that the joint sees.

    Args:
        builder: of the diagram that the plant is in; nothing else is connected to the
            plant's port `applied_generalized_force`.
        plant: of the exported file, finalized, with an actuator at each joint.
        closed: a closed loop, or the scenario of `..._effects.yaml`.

    Raises:
        DisasmError: the plant lacks a joint, an actuator or a rotor, its port is taken,
            or it can't carry an effect.
    """
    effects = _effects(closed)
    port = plant.get_applied_generalized_force_input_port()
    if builder.IsConnectedOrExported(port):
        raise DisasmError(
            "add_identified_effects: the plant's port applied_generalized_force is "
            "connected; call it before, and add other forces as spatial forces"
        )
    joints = _Joints.of(plant)
    _refuse(plant, joints, effects)
    torques = builder.AddSystem(JointEffectTorques(plant, joints, effects))
    readings = builder.AddSystem(JointReadings(plant, joints, effects))
    acceleration = _acceleration(builder, plant)
    for system in (torques, readings):
        builder.Connect(plant.get_state_output_port(), system.GetInputPort("state"))
        builder.Connect(acceleration, system.GetInputPort("acceleration"))
    builder.Connect(torques.get_output_port(), port)
    actuation = plant.get_net_actuation_output_port()
    builder.Connect(actuation, readings.GetInputPort("actuation"))
    delayed = builder.AddSystem(ReadingDelays(joints.names, effects, _period(plant)))
    builder.Connect(readings.get_output_port(), delayed.get_input_port())
    q, v, tau = (delayed.GetOutputPort(n) for n in ("position", "velocity", "torque"))
    return IdentifiedEffects(torques, q, v, tau, joints.names)


def _effects(closed: ClosedLoop | Scenario) -> list[ArmEffect]:
    if isinstance(closed, ClosedLoop):
        every: Sequence[object] = IdentifiedArm.of(closed).effects
    else:
        every = closed.effects
    return [e for e in every if isinstance(e, ArmEffect) and not e.is_null]


def _period(plant: MultibodyPlant) -> float:
    return plant.time_step() or _PERIOD


def _acceleration(builder: DiagramBuilder, plant: MultibodyPlant) -> OutputPort:
    """Returns a port of the plant's accelerations that does not depend on forces now.

    Those of a discrete plant are of its last step; a continuous plant's are held.
    """
    output = plant.get_generalized_acceleration_output_port()
    force = plant.get_applied_generalized_force_input_port()
    if not plant.HasDirectFeedthrough(force.get_index(), output.get_index()):
        return output
    hold = builder.AddSystem(ZeroOrderHold(_period(plant), plant.num_velocities()))
    builder.Connect(output, hold.get_input_port())
    return hold.get_output_port()


@dataclass(frozen=True)
class _Joints:
    """The driven joints of a plant.

    Attributes:
        names: in the order of the plant's velocities.
        q, v: where each is in the plant's positions and velocities.
        u: where each is in the plant's actuation.
        instances: the models that they are in.
        damping: that the plant simulates.
        rotor: reflected inertia that the plant simulates.
    """

    names: tuple[str, ...]
    q: list[int]
    v: list[int]
    u: list[int]
    instances: list[ModelInstanceIndex]
    damping: Array
    rotor: Array

    @classmethod
    def of(cls, plant: MultibodyPlant) -> "_Joints":
        """Returns the joints with an actuator and one degree of freedom."""
        indices = plant.GetJointActuatorIndices()
        actuators = [plant.get_joint_actuator(index) for index in indices]
        actuators = [a for a in actuators if a.joint().num_velocities() == 1]
        actuators.sort(key=lambda a: a.joint().velocity_start())
        joints = [actuator.joint() for actuator in actuators]
        return cls(
            tuple(joint.name() for joint in joints),
            [joint.position_start() for joint in joints],
            [joint.velocity_start() for joint in joints],
            [actuator.input_start() for actuator in actuators],
            list(
                {int(j.model_instance()): j.model_instance() for j in joints}.values()
            ),
            np.array([joint.default_damping() for joint in joints]),
            np.array(
                [
                    a.default_rotor_inertia() * a.default_gear_ratio() ** 2
                    for a in actuators
                ]
            ),
        )


def _refuse(
    plant: MultibodyPlant, joints: _Joints, effects: Sequence[ArmEffect]
) -> None:
    """Refuses effects that a plant can't carry."""
    for effect in effects:
        kind, joint = type(effect).__name__, getattr(effect, "joint", None)
        if joint is not None and joint not in joints.names:
            raise DisasmError(
                f"{kind}: the plant has no actuator at a joint '{joint}' "
                f"({closest(joint, list(joints.names))}); add one by AddJointActuator "
                "before Finalize"
            )
        if not isinstance(effect, _CARRIED):
            raise DisasmError(
                f"{kind}: a plant of rigid joints can't carry it; give a scenario "
                "without this effect"
            )
        if isinstance(effect, RotorInertia):
            rotor = joints.rotor[joints.names.index(effect.joint)]
            if rotor < (1.0 - _SAME) * effect.inertia:
                raise DisasmError(
                    f"RotorInertia.{effect.joint}: the plant has {rotor:.3g} of "
                    f"{effect.inertia:.3g} kg m^2; parse the exported file instead"
                )


_IN_FILE = (FlangePayload, RotorInertia, JointViscousFriction)
_CARRIED = (
    *_IN_FILE,
    ArmTorqueEffect,
    JointMemoryEffect,
    ArmTilt,
    EncoderError,
    DelayEffect,
)


class _OfState(LeafSystem):
    """Has a plant's state and accelerations as inputs, and the load that they take."""

    def __init__(self, plant: MultibodyPlant, joints: _Joints) -> None:
        super().__init__()
        self._plant, self._joints = plant, joints
        self._of_plant = plant.CreateDefaultContext()
        states = plant.num_positions() + plant.num_velocities()
        self._state = self.DeclareVectorInputPort("state", states)
        count = plant.num_velocities()
        self._acceleration = self.DeclareVectorInputPort("acceleration", count)

    def _motion(self, context: Context) -> ArmSamples:
        """Returns the joints' motion (joints,), with the rigid bodies' load.

        Gravity, inertia and payload of the plant by its inverse dynamics; forces of
        contact are not in it.
        """
        plant, joints = self._plant, self._joints
        state, vdot = self._state.Eval(context), self._acceleration.Eval(context)
        plant.SetPositionsAndVelocities(self._of_plant, state)
        load = plant.CalcInverseDynamics(
            self._of_plant, vdot, MultibodyForces(plant)
        ) - plant.CalcGravityGeneralizedForces(self._of_plant)
        q, v = state[: plant.num_positions()], state[plant.num_positions() :]
        own = load[joints.v] - joints.rotor * vdot[joints.v]
        return ArmSamples(joints.names, q[joints.q], v[joints.v], vdot[joints.v], own)


class JointEffectTorques(_OfState):
    """The forces of effects on a plant's joints, against those that drives give.

    An effect's torque is what its joint's drive gives beyond the rigid bodies' load, so
    that the plant gets it with the other sign. Inputs are all the plant's; so is the
    output, (velocities,) [N m, or N]. Memories of the path go on every period.

    @system
    name: JointEffectTorques
    input_ports:
    - state
    - acceleration
    output_ports:
    - generalized_force
    @endsystem

    Args:
        plant: finalized.
        joints: its driven joints.
        effects: that act on it; those of who reads the arm are passed over.
    """

    def __init__(
        self, plant: MultibodyPlant, joints: _Joints, effects: Sequence[ArmEffect]
    ) -> None:
        super().__init__(plant, joints)
        self._by_motion = [
            e
            for e in effects
            if isinstance(e, ArmTorqueEffect) and e.moves_the_arm
            if not isinstance(e, _IN_FILE)
        ]
        self._remembering = [e for e in effects if isinstance(e, JointMemoryEffect)]
        self._damping = _damping(joints, effects) - joints.damping
        self._dg = _tilt(effects, plant.gravity_field().gravity_vector())
        # The positions of the last period, and what was remembered there.
        size = len(joints.names) + len(self._remembering)
        self._memory = self.DeclareDiscreteState(size)
        if self._remembering:
            self.DeclarePeriodicDiscreteUpdateEvent(_period(plant), 0.0, self._remember)
            self.DeclareInitializationDiscreteUpdateEvent(self._begin)
        count = plant.num_velocities()
        self.DeclareVectorOutputPort("generalized_force", count, self._calc)

    def torques(self, context: Context) -> Array:
        """Returns what drives give beyond the rigid bodies' load (joints,)."""
        samples = self._motion(context)
        added = self._damping * samples.v
        for effect in self._by_motion:
            added = added + _at_once(effect, samples)
        memories = self._remembered(context, samples.q)
        for friction, memory in zip(self._remembering, memories, strict=True):
            added[samples.joints.index(friction.joint)] += friction.torque(memory)
        return np.asarray(added)

    def _calc(self, context: Context, output: BasicVector) -> None:
        force = np.zeros(self._plant.num_velocities())
        force[self._joints.v] = -self.torques(context)
        if self._dg.any():
            force += self._weight_of_tilt()
        output.SetFromVector(force)

    def _weight_of_tilt(self) -> Array:
        """Returns the forces (velocities,) of the change of gravity by a tilt."""
        plant, world = self._plant, self._plant.world_frame()
        J = plant.CalcJacobianCenterOfMassTranslationalVelocity(
            self._of_plant,
            self._joints.instances,
            JacobianWrtVariable.kV,
            world,
            world,
        )
        mass = plant.CalcTotalMass(self._of_plant, self._joints.instances)
        return np.asarray(mass * self._dg @ J)

    def _remembered(self, context: Context, q: Array) -> list[Array]:
        """Returns what each effect with a memory remembers at positions (joints,)."""
        state = context.get_discrete_state(self._memory).value()
        count = len(self._joints.names)
        memories = []
        for effect, memory in zip(self._remembering, state[count:], strict=True):
            i = self._joints.names.index(effect.joint)
            memories.append(
                effect.remember(np.array(memory), q[i] - np.array(state[i]))
            )
        return memories

    def _remember(self, context: Context, values: DiscreteValues) -> None:
        q = self._state.Eval(context)[self._joints.q]
        state = np.array([*q, *self._remembered(context, q)])
        values.set_value(self._memory, state)

    def _begin(self, context: Context, values: DiscreteValues) -> None:
        q = self._state.Eval(context)[self._joints.q]
        values.set_value(self._memory, np.array([*q, *[0.0] * len(self._remembering)]))


class JointReadings(_OfState):
    """What encoders and torque sensors read of a plant's joints, without delays.

    The output is position, velocity and torque of all joints, (3 joints,). A torque is
    what the joint's drive gives, and what gain errors add of the load.

    @system
    name: JointReadings
    input_ports:
    - state
    - acceleration
    - actuation
    output_ports:
    - readings
    @endsystem

    Args:
        plant: finalized.
        joints: its driven joints.
        effects: of who reads the arm; others are passed over.
    """

    def __init__(
        self, plant: MultibodyPlant, joints: _Joints, effects: Sequence[ArmEffect]
    ) -> None:
        super().__init__(plant, joints)
        self._encoders = [e for e in effects if isinstance(e, EncoderError)]
        self._sensors = [
            e for e in effects if isinstance(e, ArmTorqueEffect) and not e.moves_the_arm
        ]
        count = plant.num_actuated_dofs()
        self._actuation = self.DeclareVectorInputPort("actuation", count)
        self.DeclareVectorOutputPort("readings", 3 * len(joints.names), self._calc)

    def _calc(self, context: Context, output: BasicVector) -> None:
        samples = self._motion(context)
        torque = np.array(self._actuation.Eval(context)[self._joints.u])
        for sensor in self._sensors:
            torque += _at_once(sensor, samples)
        q, v = samples.q.copy(), samples.v.copy()
        for encoder in self._encoders:
            i = samples.joints.index(encoder.joint)
            off_q, off_v = encoder.off(samples.q[i], samples.v[i])
            q[i], v[i] = q[i] + off_q, v[i] + off_v
        output.SetFromVector(np.concatenate([q, v, torque]))


class ReadingDelays(LeafSystem):
    """Readings of joints, each as late as it was identified to be.

    A positive delay is the torque's, a negative one the motion's. Late readings are
    sampled every period, interpolated between two samples, and held; the others pass
    through.

    @system
    name: ReadingDelays
    input_ports:
    - readings
    output_ports:
    - position
    - velocity
    - torque
    @endsystem

    Args:
        joints: their names.
        effects: of which shifts in time act.
        period: of the samples [s].
    """

    def __init__(
        self, joints: Sequence[str], effects: Sequence[ArmEffect], period: float
    ) -> None:
        super().__init__()
        shifts = [e for e in effects if isinstance(e, DelayEffect)]
        late = np.array([sum(e.delay for e in shifts if e.delays(j)) for j in joints])
        of_motion, of_torque = np.maximum(-late, 0.0), np.maximum(late, 0.0)
        self._steps = np.concatenate([of_motion, of_motion, of_torque]) / period
        count = len(self._steps)
        most = float(self._steps.max(initial=0.0))
        self._kept = int(np.ceil(most)) + 1 if most else 0
        self._readings = self.DeclareVectorInputPort("readings", count)
        self._past = self.DeclareDiscreteState(self._kept * count)
        if self._kept:
            self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._sample)
            self.DeclareInitializationDiscreteUpdateEvent(self._begin)
        for number, name in enumerate(("position", "velocity", "torque")):
            part = slice(number * len(joints), (number + 1) * len(joints))
            self.DeclareVectorOutputPort(
                name,
                len(joints),
                lambda context, output, part=part: output.SetFromVector(
                    self._read(context)[part]
                ),
            )

    def _read(self, context: Context) -> Array:
        now = self._readings.Eval(context)
        if not self._kept:
            return np.asarray(now)
        table, columns = self._samples(context), np.arange(len(self._steps))
        whole = np.floor(self._steps).astype(int)
        share, older = self._steps - whole, np.minimum(whole + 1, self._kept - 1)
        before, after = table[older, columns], table[whole, columns]
        late = (1.0 - share) * after + share * before
        return np.where(self._steps > 0.0, late, now)

    def _samples(self, context: Context) -> Array:
        """Returns the readings (kept, 3 joints) of the last periods, newest first."""
        past = context.get_discrete_state(self._past).value()
        return np.asarray(past.reshape(self._kept, -1))

    def _sample(self, context: Context, values: DiscreteValues) -> None:
        now, past = self._readings.Eval(context), self._samples(context)
        values.set_value(self._past, np.vstack([now, past[:-1]]).reshape(-1))

    def _begin(self, context: Context, values: DiscreteValues) -> None:
        now = self._readings.Eval(context)
        values.set_value(self._past, np.tile(now, self._kept))


def _damping(joints: _Joints, effects: Sequence[ArmEffect]) -> Array:
    """Returns the identified damping of each joint."""
    viscous = [e for e in effects if isinstance(e, JointViscousFriction)]
    return np.array(
        [sum(e.coefficient for e in viscous if e.joint == j) for j in joints.names]
    )


def _tilt(effects: Sequence[ArmEffect], g_W: Array) -> Array:
    """Returns the change of gravity (3,) by tilts of the base."""
    tilts = [e for e in effects if isinstance(e, ArmTilt)]
    turn = np.array([sum(e.rx for e in tilts), sum(e.ry for e in tilts), 0.0])
    return -np.cross(turn, g_W)


def _at_once(effect: ArmTorqueEffect, samples: ArmSamples) -> Array:
    """Returns an effect's torques (joints,) of one moment."""
    parts = {n: getattr(samples, n)[None] for n in ("q", "v", "vd", "load")}
    return np.asarray(effect.torques(dataclasses.replace(samples, **parts))[0])
