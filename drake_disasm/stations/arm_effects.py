"""What effects on the arm do in the cell: to its plant's Context, and as friction."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    Frame,
    JointActuator,
    ModelInstanceIndex,
    RevoluteJoint,
    SpatialInertia,
    UnitInertia,
)
from pydrake.symbolic import Expression, Variable
from pydrake.symbolic import max as maximum
from pydrake.systems.framework import Context, DiagramBuilder, OutputPort
from pydrake.systems.primitives import Multiplexer, SymbolicVectorSystem

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.quantity import closest
from drake_disasm.effects import (
    ArmEffect,
    FlangePayload,
    JointAsymmetricFriction,
    JointCoulombFriction,
    JointEffect,
    JointLoadFriction,
    JointSamples,
    JointStribeckFriction,
    JointViscousFriction,
    RotorInertia,
    TorqueGain,
    TorqueOffset,
    amplitudes,
    shape_parameters,
)

#: Friction that Drake's joints lack.
_Rubbing = (
    JointCoulombFriction
    | JointStribeckFriction
    | JointAsymmetricFriction
    | JointLoadFriction
)
_RUBBING: tuple[type[_Rubbing], ...] = (
    JointCoulombFriction,
    JointStribeckFriction,
    JointAsymmetricFriction,
    JointLoadFriction,
)
_TINY = 1e-9  # N m, against 0 / 0


class ArmMechanics:
    """The arm's friction, rotors, payload and sensors, as its Contexts have them.

    Viscous friction is a joint's damping, which the solver takes implicitly; a
    rotor's inertia and the payload are Drake's own as well. Drake's joints have no
    dry friction, so a system beside the plant adds it as a generalized force in each
    of the plant's steps. It is made of the effects' own equations as symbolic
    expressions, which Drake evaluates without Python.

    A force by the velocity at a step's beginning overshoots where it is steeper than
    M / h (M the rotor's inertia, h the step), so a joint's `creep` is widened to what
    a step can follow: 9 N m at joint 4 to 0.007 rad/s. Faster than that nothing
    changes; slower, and at rest, the joint gives way at that speed.

    What a torque sensor reads wrongly shows in `torque_measured` alone; the cell's
    drives do not go by it, and `torque_external` is what truly pushes.

    Attributes:
        friction: the system that adds it; inputs are the joints' velocities and the
            torques of their drives in the step before, output is for the plant.
        sensor: the system that reads the drives' torques.
    """

    def __init__(
        self, plant: MultibodyPlant, arm: ModelInstanceIndex, frame_F: Frame
    ) -> None:
        """Looks the arm with its flange up in a finalized plant."""
        self._plant, self._flange = plant, frame_F.body()
        indices = plant.GetJointActuatorIndices(arm)
        actuators = [plant.get_joint_actuator(index) for index in indices]
        self._actuators = {a.joint().name(): a for a in actuators}
        self._joints = [_RubbingJoint(a.joint()) for a in actuators]
        self.friction = self._friction()
        self.sensor = _torque_sensor(list(self._actuators))

    def wire(
        self, builder: DiagramBuilder, velocity: OutputPort, torque: OutputPort
    ) -> OutputPort:
        """Adds friction and sensor to the diagram, behind ports of all joints.

        Returns:
            The port of the torques as they are measured.
        """
        count = len(self._joints)
        state = builder.AddNamedSystem("arm_friction_state", Multiplexer([count] * 2))
        builder.AddNamedSystem("arm_friction", self.friction)
        builder.Connect(velocity, state.get_input_port(0))
        builder.Connect(torque, state.get_input_port(1))
        builder.Connect(state.get_output_port(), self.friction.get_input_port())
        builder.Connect(
            self.friction.get_output_port(),
            self._plant.get_applied_generalized_force_input_port(),
        )
        builder.AddNamedSystem("arm_torque_sensor", self.sensor)
        builder.Connect(torque, self.sensor.get_input_port())
        return self.sensor.get_output_port()

    def set_effects(
        self,
        plant_context: Context,
        friction_context: Context,
        sensor_context: Context,
        effects: Sequence[ArmEffect],
    ) -> None:
        """Puts effects, and no others, onto the arm of a Context.

        Raises:
            DisasmError: the cell can't carry one of them, or its joint is not the
                arm's.
        """
        own = self._by_joint(effects)
        sensor_context.get_mutable_numeric_parameter(0).SetFromVector(
            np.concatenate([_misreadings(own[name]) for name in self._actuators])
        )
        values: list[float] = []
        for joint, (name, actuator) in zip(
            self._joints, self._actuators.items(), strict=True
        ):
            _set_rotor(plant_context, actuator, own[name])
            _set_damping(plant_context, actuator.joint(), own[name])
            steepest = (
                actuator.calc_reflected_inertia(plant_context) / self._plant.time_step()
            )
            slope = _slope(own[name], actuator.effort_limit())
            values += joint.values(own[name], max(1.0, slope / steepest))
        friction_context.get_mutable_numeric_parameter(0).SetFromVector(values)
        payloads = [e for e in effects if isinstance(e, FlangePayload)]
        M_F = _with_payloads(self._flange.default_spatial_inertia(), payloads)
        self._flange.SetSpatialInertiaInBodyFrame(plant_context, M_F)

    def _by_joint(self, effects: Sequence[ArmEffect]) -> dict[str, list[JointEffect]]:
        own: dict[str, list[JointEffect]] = {name: [] for name in self._actuators}
        for effect in effects:
            if not isinstance(effect, JointEffect):
                continue
            if effect.joint not in own:
                raise DisasmError(
                    f"{type(effect).__name__}.joint: the arm has no joint "
                    f"'{effect.joint}'; {closest(effect.joint, list(own))}"
                )
            own[effect.joint].append(effect)
        return own

    def _friction(self) -> SymbolicVectorSystem:
        """Returns the system that adds friction to the plant."""
        applied = np.array([Expression(0.0)] * self._plant.num_velocities())
        for joint in self._joints:
            applied[joint.column] = joint.applied()
        inputs = [joint.v for joint in self._joints] + [j.u for j in self._joints]
        parameters = [p for joint in self._joints for p in joint.parameters]
        return SymbolicVectorSystem(
            input=np.array(inputs),
            parameter=np.array(parameters),
            output=applied,
        )


class _RubbingJoint:
    """Symbols of one joint's friction.

    Attributes:
        column: of its velocity in the plant.
        v, u: its velocity, and the torque of its drive in the step before.
        parameters: sizes and shapes of each of _RUBBING.
    """

    def __init__(self, joint: RevoluteJoint) -> None:
        name = joint.name()
        self._name, self.column = name, joint.velocity_start()
        self.v, self.u = Variable(f"{name}.v"), Variable(f"{name}.u")
        self._effects: list[JointEffect] = []
        self.parameters: list[Variable] = []
        for kind in _RUBBING:
            symbols = {
                n: Variable(f"{name}.{kind.__name__}.{n}") for n in _numbers(kind)
            }
            self._effects.append(kind(**symbols))
            self.parameters += symbols.values()

    def applied(self) -> Expression:
        """Returns the force on the joint: against its friction's measured torque.

        Of the drive's torque u, friction by load g |L|, g odd in v, leaves the load
        L: u = L + g |L|, so that g |L| = g u^2 / (|u| + g u), at most 2 g |u|: a gear
        near self-locking would be stiffer than a step can follow. (What the other
        frictions take off u is left in L: friction of friction.)
        """
        *dry, by_load = self._effects
        rubbing = sum((_torque(e, self.v, 0.0) for e in dry), Expression(0.0))
        g, u = _torque(by_load, self.v, 1.0), Expression(self.u)
        share = maximum(abs(u) + g * u, 0.5 * abs(u)) + _TINY
        return -rubbing - g * u * u / share

    def values(self, effects: Sequence[JointEffect], wider: float) -> list[float]:
        """Returns the values of `parameters`.

        Args:
            effects: at this joint.
            wider: factor on their `creep`.

        Raises:
            DisasmError: two effects are of one kind.
        """
        values = []
        for kind in _RUBBING:
            found = [e for e in effects if isinstance(e, kind)] or [kind()]
            if len(found) > 1:
                raise DisasmError(
                    f"{kind.__name__}: acts twice on {self._name}; the cell takes one "
                    "of a kind per joint, merge them"
                )
            wide = dataclasses.replace(found[0], creep=wider * found[0].creep)
            values += [getattr(wide, name) for name in _numbers(kind)]
        return values


def _torque_sensor(joints: Sequence[str]) -> SymbolicVectorSystem:
    """Returns the system that reads joints' torques, each with a gain and an offset."""
    u = [Variable(f"{name}.torque") for name in joints]
    wrong = [(Variable(f"{n}.share"), Variable(f"{n}.offset")) for n in joints]
    reading = [t + share * t + c for t, (share, c) in zip(u, wrong, strict=True)]
    parameters = [symbol for pair in wrong for symbol in pair]
    return SymbolicVectorSystem(
        input=np.array(u), parameter=np.array(parameters), output=np.array(reading)
    )


def _misreadings(effects: Sequence[JointEffect]) -> np.ndarray:
    """Returns share and offset (2,) by which a joint's sensor is wrong."""
    share = sum(e.share for e in effects if isinstance(e, TorqueGain))
    offset = sum(e.size for e in effects if isinstance(e, TorqueOffset))
    return np.array([share, offset], dtype=float)


def _numbers(kind: type[JointEffect]) -> list[str]:
    """Returns the names of a kind's sizes and shapes."""
    return [*amplitudes(kind), *shape_parameters(kind)]


def _torque(effect: JointEffect, v: Variable, load: float) -> Expression:
    """Returns a joint effect's own equation in symbols."""
    none = np.array([Expression(0.0)])
    samples = JointSamples(none, np.array([Expression(v)]), none, none + load)
    with np.errstate(all="ignore"):  # symbols are NaN on the way
        return effect.torque(samples)[0]


def _set_rotor(
    context: Context, actuator: JointActuator, effects: Sequence[JointEffect]
) -> None:
    """Adds reflected inertia: that of the rotor times its gear ratio squared."""
    more = sum(e.inertia for e in effects if isinstance(e, RotorInertia))
    rotor = actuator.default_rotor_inertia() + more / actuator.gear_ratio(context) ** 2
    actuator.SetRotorInertia(context, rotor)


def _set_damping(
    context: Context, joint: RevoluteJoint, effects: Sequence[JointEffect]
) -> None:
    more = sum(e.coefficient for e in effects if isinstance(e, JointViscousFriction))
    joint.SetDamping(context, joint.default_damping() + more)


def _slope(effects: Sequence[JointEffect], load: float) -> float:
    """Returns how steep friction is [N m s/rad], at most, under a load [N m]."""
    slope = 0.0
    for effect in effects:
        if isinstance(effect, _Rubbing):
            v = effect.creep * np.linspace(-5.0, 5.0, 1001)
            samples = JointSamples(0.0 * v, v, 0.0 * v, np.full_like(v, load))
            slope += np.abs(np.gradient(effect.torque(samples), v)).max()
    return slope


def _with_payloads(
    M_F: SpatialInertia, payloads: Sequence[FlangePayload]
) -> SpatialInertia:
    """Returns a body's inertia about Fo in F with payloads added.

    Raises:
        DisasmError: a payload has a first moment but no mass.
    """
    for payload in payloads:
        if payload.mass > 0.0:
            xx, xy, xz, yy, yz, zz = payload.inertial[4:] / payload.mass
            G = UnitInertia(xx, yy, zz, xy, xz, yz)
            p_FoPcm_F = payload.first_moment / payload.mass
            more = SpatialInertia(payload.mass, p_FoPcm_F, G, skip_validity_check=True)
            M_F = more if M_F.get_mass() == 0.0 else M_F + more
        elif payload.first_moment.any():
            raise DisasmError(
                "FlangePayload: no body has a first moment (cx, cy, cz) and no mass; "
                "give it a mass"
            )
    return M_F
