"""How the cell simulates effects on the arm."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JointActuator, RevoluteJoint
from pydrake.symbolic import Expression, Variable
from pydrake.systems.framework import DiagramBuilder, OutputPort
from pydrake.systems.primitives import (
    Adder,
    ConstantVectorSource,
    Demultiplexer,
    Gain,
    LinearSystem,
    Multiplexer,
    SymbolicVectorSystem,
)

from drake_disasm.cell.arm_model import ArmModel
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.quantity import closest
from drake_disasm.effects import (
    ArmEffect,
    EncoderError,
    FlangePayload,
    JointViscousFriction,
    RotorInertia,
    TorqueGain,
    TorqueOffset,
)
from drake_disasm.stations.base import Parts
from drake_disasm.stations.flange_payload import add_payload_body, payload_inertia
from drake_disasm.stations.joint_friction import (
    IN_JOINTS,
    JointFriction,
    steepest_slope,
)

_CARRIED: tuple[type[ArmEffect], ...] = (
    *IN_JOINTS,
    JointViscousFriction,
    RotorInertia,
    TorqueGain,
    TorqueOffset,
    FlangePayload,
    EncoderError,
)


@dataclasses.dataclass(frozen=True)
class _Joint:
    """A joint of the arm, as its model file has it.

    Attributes:
        actuator: its drive.
        joint: the same as `actuator.joint()`.
        rotor_inertia, gear_ratio: of the drive [kg m^2], [1].
        damping: of the joint [N m s/rad].
    """

    actuator: JointActuator
    joint: RevoluteJoint
    rotor_inertia: float
    gear_ratio: float
    damping: float


@dataclasses.dataclass(frozen=True)
class _ArmNumbers:
    """All numbers that effects on the arm change.

    Attributes:
        rotor_inertia: (n,) of the drives [kg m^2].
        damping: (n,) of the joints [N m s/rad].
        friction: (k,) values of the friction's symbols.
        misreading: (2 n,) share and offset [N m] of each torque sensor's error.
        encoders: (2 n,) offset [rad] and scale of each encoder's error.
    """

    rotor_inertia: list[float]
    damping: list[float]
    friction: np.ndarray
    misreading: np.ndarray
    encoders: np.ndarray


class ArmMechanics:
    """The arm's friction, springs, rotors, payload and sensors.

    Viscous friction is a joint's damping, which the solver takes implicitly; a
    rotor's inertia and the payload are Drake's own as well. Drake's joints have no
    dry friction, so a separate system adds it as a generalized force in each
    of the plant's steps, and the torque of a spring. It is made of the effects' own
    equations as symbolic expressions, which Drake evaluates without Python. What
    pre-sliding friction remembers is the state of a system of its own.

    A force by the velocity at a step's beginning overshoots where it is steeper than
    M / h (M the rotor's inertia, h the step), so a joint's `creep` is widened to what
    a step can follow: 9 N m at joint 4 to 0.007 rad/s. Faster than that nothing
    changes; slower, and at rest, the joint gives way at that speed.

    Torque sensor errors appear in `torque_measured` only: the cell's drives do not use
    it, and `torque_external` is the true external torque. Encoder errors reach the
    controller, too: it takes the arm to where the encoders read what is commanded.

    Args:
        plant: with the arm, not yet finalized.
        arm: on its base in the plant.
        effects: of the default Context.
    """

    def __init__(
        self,
        plant: MultibodyPlant,
        arm: ArmModel,
        effects: Sequence[ArmEffect],
    ) -> None:
        self._plant = plant
        self._payload = add_payload_body(plant, arm.frame_F, effects)
        self._joints: dict[str, _Joint] = {}
        for index in plant.GetJointActuatorIndices():  # by instance: not yet finalized
            actuator = plant.get_joint_actuator(index)
            if actuator.model_instance() != arm.instance:
                continue
            joint = actuator.joint()
            self._joints[joint.name()] = _Joint(
                actuator,
                joint,
                actuator.default_rotor_inertia(),
                actuator.default_gear_ratio(),
                joint.default_damping(),
            )
        h = plant.time_step()
        self._friction = [JointFriction(name, h) for name in self._joints]
        self._defaults = self._numbers(effects)
        self._set_defaults()

    def wire(
        self,
        builder: DiagramBuilder,
        position: OutputPort,
        velocity: OutputPort,
        torque: OutputPort,
    ) -> OutputPort:
        """Adds friction and torque sensor to the diagram.

        Their parameters are inputs from constant sources, since the parameters of a
        SymbolicVectorSystem are NaN by default.

        Args:
            builder: of the station, whose plant is finalized.
            position, velocity: of the joints.
            torque: of their drives, in the step before.

        Returns:
            The port of the torques as they are measured.
        """
        self._friction_values = ConstantVectorSource(self._defaults.friction)
        self._misreading = ConstantVectorSource(self._defaults.misreading)
        count, h = len(self._joints), self._plant.time_step()
        one, none = np.eye(count), np.zeros((count, count))
        self._memory = LinearSystem(none, one, one, none, h)
        builder.AddNamedSystem("arm_friction_memory", self._memory)
        friction = _add_symbolic(
            builder,
            "arm_friction",
            self._friction_system(),
            [position, velocity, torque, self._memory.get_output_port()],
            self._friction_values,
        )
        self._connect_friction(builder, friction)
        return _add_symbolic(
            builder,
            "arm_torque_sensor",
            _torque_sensor(list(self._joints)),
            [torque],
            self._misreading,
        )

    def wire_encoders(
        self, builder: DiagramBuilder, state: OutputPort, desired: OutputPort
    ) -> tuple[OutputPort, OutputPort]:
        """Adds the encoders to the diagram.

        Args:
            builder: of the station.
            state: (2 n,) positions and velocities of the joints.
            desired: (2 n,) of them, as encoders should read.

        Returns:
            The port of what encoders read (2 n,), and that of the state (2 n,) which
            the plant's own drives have to go for, as they know nothing of encoders.
        """
        self._encoder_errors = ConstantVectorSource(self._defaults.encoders)
        size = state.size()
        wrong = _add_symbolic(
            builder,
            "arm_encoders",
            _encoders(list(self._joints)),
            [state],
            self._encoder_errors,
        )
        against = builder.AddNamedSystem("arm_encoders_against", Gain(-1.0, size))
        builder.Connect(wrong, against.get_input_port())
        reading, goal = (
            builder.AddNamedSystem(name, Adder(2, size))
            for name in ("arm_encoders_reading", "arm_drives_desired")
        )
        builder.Connect(state, reading.get_input_port(0))
        builder.Connect(wrong, reading.get_input_port(1))
        builder.Connect(desired, goal.get_input_port(0))
        builder.Connect(against.get_output_port(), goal.get_input_port(1))
        return reading.get_output_port(), goal.get_output_port()

    def take_as_default(self, parts: Parts) -> None:
        """Makes what friction remembers in a Context that of the default Context."""
        memory = parts(self._memory).get_discrete_state_vector()
        self._memory.configure_default_state(memory.CopyToVector())

    def forget(self, parts: Parts) -> None:
        """Lets friction remember nothing."""
        parts(self._memory).SetDiscreteState(np.zeros(len(self._joints)))

    def set_effects(self, effects: Sequence[ArmEffect], parts: Parts) -> None:
        """Puts effects, and no others, onto the arm of a Context.

        Raises:
            DisasmError: the cell can't carry one of them.
        """
        plant_context = parts(self._plant)
        numbers = self._numbers(effects)
        for joint, rotor_inertia, damping in zip(
            self._joints.values(), numbers.rotor_inertia, numbers.damping, strict=True
        ):
            joint.actuator.SetRotorInertia(plant_context, rotor_inertia)
            joint.joint.SetDamping(plant_context, damping)
        for source, values in (
            (self._friction_values, numbers.friction),
            (self._misreading, numbers.misreading),
            (self._encoder_errors, numbers.encoders),
        ):
            value = source.get_mutable_source_value(parts(source))
            value.SetFromVector(values)
        M_F = payload_inertia(effects)
        self._payload.SetSpatialInertiaInBodyFrame(plant_context, M_F)

    def _set_defaults(self) -> None:
        numbers = self._defaults
        for joint, rotor_inertia, damping in zip(
            self._joints.values(), numbers.rotor_inertia, numbers.damping, strict=True
        ):
            joint.actuator.set_default_rotor_inertia(rotor_inertia)
            joint.joint.set_default_damping(damping)

    def _by_joint(self, effects: Sequence[ArmEffect]) -> dict[str, list[ArmEffect]]:
        own: dict[str, list[ArmEffect]] = {name: [] for name in self._joints}
        for effect in effects:
            joint = getattr(effect, "joint", None)
            if joint is None:
                continue
            if joint not in own:
                raise DisasmError(
                    f"{type(effect).__name__}.joint: the arm has no joint "
                    f"'{joint}'; {closest(joint, list(own))}"
                )
            own[joint].append(effect)
        return own

    def _numbers(self, effects: Sequence[ArmEffect]) -> _ArmNumbers:
        own, joints = self._by_joint(effects), self._joints.items()
        friction: list[float] = []
        for symbols, (name, joint) in zip(self._friction, joints, strict=True):
            inertia = joint.gear_ratio**2 * _rotor_inertia(joint, own[name])
            steepest = inertia / self._plant.time_step()
            slope = steepest_slope(own[name], joint.actuator.effort_limit())
            friction += symbols.values(own[name], max(1.0, slope / steepest))
        return _ArmNumbers(
            [_rotor_inertia(joint, own[name]) for name, joint in joints],
            [_damping(joint, own[name]) for name, joint in joints],
            np.array(friction),
            np.concatenate([_misreading(own[name]) for name in self._joints]),
            np.concatenate([_encoder_error(own[name]) for name in self._joints]),
        )

    def _friction_system(self) -> SymbolicVectorSystem:
        """Returns the system of the forces on the plant, and of friction's memory."""
        joints = self._friction
        applied = np.array([Expression(0.0)] * self._plant.num_velocities())
        for joint, symbols in zip(self._joints.values(), joints, strict=True):
            applied[joint.joint.velocity_start()] = symbols.applied()
        inputs = [getattr(j, n) for n in ("q", "v", "u", "memory") for j in joints]
        inputs += [symbol for joint in joints for symbol in joint.parameters]
        output = [*applied, *(joint.remembered() for joint in joints)]
        return SymbolicVectorSystem(input=np.array(inputs), output=np.array(output))

    def _connect_friction(self, builder: DiagramBuilder, friction: OutputPort) -> None:
        """Connects forces to the plant, and what is remembered to the memory."""
        sizes = [self._plant.num_velocities(), len(self._joints)]
        split = builder.AddNamedSystem("arm_friction_split", Demultiplexer(sizes))
        builder.Connect(friction, split.get_input_port())
        forces = self._plant.get_applied_generalized_force_input_port()
        builder.Connect(split.get_output_port(0), forces)
        builder.Connect(split.get_output_port(1), self._memory.get_input_port())


def refuse_unknown_arm_effects(effects: Sequence[ArmEffect]) -> None:
    """Refuses effects on the arm that the cell does not simulate.

    Raises:
        DisasmError: names the first.
    """
    for effect in effects:
        if not isinstance(effect, _CARRIED):
            raise DisasmError(
                f"{type(effect).__name__}: acts on the arm in a way that the cell does "
                "not simulate; take it out of effects"
            )


def _add_symbolic(
    builder: DiagramBuilder,
    name: str,
    system: SymbolicVectorSystem,
    inputs: Sequence[OutputPort],
    parameters: ConstantVectorSource,
) -> OutputPort:
    """Adds a system of expressions, and the source of the last of its inputs."""
    builder.AddNamedSystem(name, system)
    builder.AddNamedSystem(f"{name}_parameters", parameters)
    ports = [*inputs, parameters.get_output_port()]
    inputs_of_all = builder.AddNamedSystem(
        f"{name}_inputs", Multiplexer([port.size() for port in ports])
    )
    for i, port in enumerate(ports):
        builder.Connect(port, inputs_of_all.get_input_port(i))
    builder.Connect(inputs_of_all.get_output_port(), system.get_input_port())
    return system.get_output_port()


def _torque_sensor(joints: Sequence[str]) -> SymbolicVectorSystem:
    """Returns the system that reads joints' torques, each with a gain and an offset."""
    u = [Variable(f"{name}.torque") for name in joints]
    wrong = [(Variable(f"{n}.share"), Variable(f"{n}.offset")) for n in joints]
    reading = [t + share * t + c for t, (share, c) in zip(u, wrong, strict=True)]
    parameters = [symbol for pair in wrong for symbol in pair]
    return SymbolicVectorSystem(
        input=np.array([*u, *parameters]), output=np.array(reading)
    )


def _encoders(joints: Sequence[str]) -> SymbolicVectorSystem:
    """Returns the system of how far encoders' readings (2 n,) are off."""
    q, v = ([Variable(f"{name}.{x}") for name in joints] for x in "qv")
    errors = [
        EncoderError(n, Variable(f"{n}.offset"), Variable(f"{n}.scale")) for n in joints
    ]
    off = [e.off(*state) for e, *state in zip(errors, q, v, strict=True)]
    parameters = [symbol for e in errors for symbol in (e.offset, e.scale)]
    return SymbolicVectorSystem(
        input=np.array([*q, *v, *parameters]),
        output=np.array(
            [value for values in zip(*off, strict=True) for value in values]
        ),
    )


def _misreading(effects: Sequence[ArmEffect]) -> np.ndarray:
    """Returns share and offset (2,) by which a joint's sensor is wrong."""
    share = sum(e.share for e in effects if isinstance(e, TorqueGain))
    offset = sum(e.size for e in effects if isinstance(e, TorqueOffset))
    return np.array([share, offset], dtype=float)


def _encoder_error(effects: Sequence[ArmEffect]) -> np.ndarray:
    """Returns offset and scale (2,) by which a joint's encoder is wrong."""
    wrong = [e for e in effects if isinstance(e, EncoderError)]
    return np.array([sum(e.offset for e in wrong), sum(e.scale for e in wrong)], float)


def _rotor_inertia(joint: _Joint, effects: Sequence[ArmEffect]) -> float:
    """Returns a drive's rotor inertia; effects add reflected inertia."""
    more = sum(e.inertia for e in effects if isinstance(e, RotorInertia))
    return joint.rotor_inertia + more / joint.gear_ratio**2


def _damping(joint: _Joint, effects: Sequence[ArmEffect]) -> float:
    more = sum(e.coefficient for e in effects if isinstance(e, JointViscousFriction))
    return joint.damping + more
