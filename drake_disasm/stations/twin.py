"""The digital twin: bolt, groove and contact alone."""

import dataclasses
from typing import Any

import numpy as np
from pydrake.geometry import CollisionFilterDeclaration, GeometrySet
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    Frame,
    Joint,
    JointActuator,
    PdControllerGains,
    PrismaticJoint,
    RevoluteJoint,
    RigidBody,
    SpatialInertia,
)
from pydrake.systems.framework import Context, DiagramBuilder, OutputPort
from pydrake.systems.primitives import (
    ConstantVectorSource,
    Demultiplexer,
    Multiplexer,
)

from drake_disasm.cell.coordinates import BoltCoordinates
from drake_disasm.cell.lock import (
    GROOVE_FIELDS,
    add_lock,
    nominal_environment,
    reshape_groove,
)
from drake_disasm.cell.tool import Tool
from drake_disasm.common.errors import DisasmError
from drake_disasm.effects import Environment
from drake_disasm.impact import (
    ImpactConditions,
    ImpactLaw,
    LockShape,
    Surroundings,
)
from drake_disasm.ports import TWIN_PORTS
from drake_disasm.scenario import ImpactConfig, Scenario, TwinConfig, validate
from drake_disasm.stations.simulated import SimulatedStation
from drake_disasm.systems.impact_contact import ImpactContact

_AXES = np.eye(3)
_JOINT_ORDER = (0, 1, 2, 5, 4, 3)  # x, y, z, then yaw, pitch, roll
_MATERIAL_FIELDS = ("friction", "modulus", "head_modulus", "dissipation")


class TwinStation(SimulatedStation):
    """The thesis's twin: the command moves the bolt through a six-axis spring.

    A carrier in Gn has six joints (x, y, z, then yaw, pitch and roll) whose
    controllers are the stiffness and damping of arm, gripper and sensor; the
    solver takes them implicitly. The bolt hangs on the carrier by a weld at S
    whose reaction is the sensor's load, so the readings mean the same as the
    cell's and pass the same processing.

    @system
    name: TwinStation
    input_ports:
    - bolt.position
    - bolt.velocity
    - applied_spatial_force
    output_ports:
    - bolt.position_measured
    - ft_sensor.wrench
    - ft_sensor.health
    - ft_sensor.time_measured
    - bolt.health
    - bolt.time_measured
    - bolt_pose
    - contact_results
    - query_object
    @endsystem
    """

    table = TWIN_PORTS
    arm = "bolt"
    has_velocity_input = True
    settling_time = 0.05

    def __init__(self, scenario: Scenario) -> None:
        super().__init__(scenario)
        self.control_period = scenario.simulation.twin_time_step
        self.X_SB = Tool.from_models(scenario).X_SB
        self.coordinates, self.start = BoltCoordinates(), np.zeros(6)
        builder = DiagramBuilder()
        self._build(builder)

    def can_reconfigure(self, scenario: Scenario) -> bool:
        """Returns whether `become` can turn this station into another scenario's."""
        return _structure(scenario) == _structure(self.scenario)

    def reconfigure(self, context: Context, scenario: Scenario) -> None:
        """Turns this station into that of another scenario without a rebuild.

        Identification asks for hundreds of parameter sets; in place, one costs a few
        milliseconds and leaves nothing behind, and every bit is as after a rebuild.
        Springs and dampers belong to the plant, not to the Context: a station that
        is reconfigured serves one Context.

        Args:
            context: this station's; its time and state stay as they are.
            scenario: may differ in effects, in what the contact is made of, in
                the groove's dimensions, and in the section `twin`.

        Raises:
            DisasmError: the scenario is out of bounds, or differs elsewhere.
        """
        validate(scenario)
        if not self.can_reconfigure(scenario):
            raise DisasmError(
                "the twin can't take this scenario in place; build a station of it"
            )
        self.scenario = scenario
        if self.impact is None:  # a new shape would forget the collision filter
            reshape_groove(
                self.lock,
                scenario.lock,
                self.scene_graph,
                self.part_context(self.scene_graph, context),
            )
        self.lock = dataclasses.replace(
            self.lock,
            config=scenario.lock,
            nominal=nominal_environment(scenario.lock, scenario.contact),
        )
        self._set_springs(scenario.twin, self.part_context(self.plant, context))
        self.set_effects(context, scenario.effects)

    def _build(self, builder: DiagramBuilder) -> None:
        time_step = self.scenario.simulation.twin_time_step
        frame_Gn, plant = self._add_plant(builder, time_step), self.plant
        self.lock = add_lock(plant, frame_Gn, self.scenario.lock, self.scenario.contact)
        carrier = self._add_carrier(frame_Gn)
        frame_S, joint = self._add_sensor_joint(carrier)
        plant.Finalize()
        self._read_payload(frame_S)
        self._wire_commands(builder, carrier)
        self._add_sensor(builder, joint, frame_S)
        self._add_ready_device(builder, "bolt")
        self._finish(builder, self.lock.bolt)

    def _add_carrier(self, frame_Gn: Frame) -> RigidBody:
        """Adds six joints with the spring and damper of each axis."""
        twin, plant = self.scenario.twin, self.plant
        self._actuators: dict[int, JointActuator] = {}
        self._carrier = instance = plant.AddModelInstance("carrier")
        parent, body = frame_Gn, None
        for axis in _JOINT_ORDER:
            body = plant.AddRigidBody(f"axis_{axis}", instance, SpatialInertia.Zero())
            joint = plant.AddJoint(_axis_joint(axis, parent, body.body_frame()))
            actuator = plant.AddJointActuator(f"axis_{axis}", joint)
            actuator.set_default_rotor_inertia(_inertia(twin, axis))
            actuator.set_default_gear_ratio(1.0)
            actuator.set_controller_gains(_gains(twin, axis))
            self._actuators[axis] = actuator
            parent = body.body_frame()
        assert body is not None
        return body

    def _set_springs(self, twin: TwinConfig, plant_context: Context) -> None:
        for axis, actuator in self._actuators.items():
            actuator.SetRotorInertia(plant_context, _inertia(twin, axis))
            actuator.set_controller_gains(_gains(twin, axis))

    def _apply_forces(self, builder: DiagramBuilder, forces: OutputPort) -> None:
        """Adds IMPACT's force, if that is the contact's model."""
        self.impact: ImpactContact | None = None
        if self.scenario.contact.model == "hydroelastic":
            super()._apply_forces(builder, forces)
            return
        self._part_bolt_and_groove()
        self.impact = builder.AddNamedSystem(
            "impact_contact",
            ImpactContact(self.lock.bolt.index(), self.X_WG.rotation(), self.time_step),
        )
        state = self.plant.get_state_output_port(self._carrier)
        builder.Connect(state, self.impact.GetInputPort("state"))
        desired = builder.GetSubsystemByName("desired_state").get_output_port()
        builder.Connect(desired, self.impact.GetInputPort("desired_state"))
        builder.Connect(forces, self.impact.GetInputPort("applied_spatial_force"))
        super()._apply_forces(builder, self.impact.get_output_port())

    def _part_bolt_and_groove(self) -> None:
        """Leaves their contact to IMPACT."""
        bolt, groove = (
            GeometrySet(list(ids))
            for ids in (self.lock.bolt_ids.values(), self.lock.groove_ids)
        )
        declaration = CollisionFilterDeclaration().ExcludeBetween(bolt, groove)
        self.scene_graph.collision_filter_manager().Apply(declaration)

    def _change_environment(self, context: Context, environment: Environment) -> None:
        if self.impact is None:
            super()._change_environment(context, environment)
        else:
            self._set_environment(context, environment)

    def _set_environment(self, context: Context, environment: Environment) -> None:
        if self.impact is None:
            super()._set_environment(context, environment)
            return
        plant_context = self.part_context(self.plant, context)
        force_context = self.part_context(self.outside_force, context)
        self.outside_force.set_force(force_context, np.array(environment.force_Gn))
        self.lock.frame.SetPoseInParentFrame(plant_context, environment.X_GnG)
        gains = [self._actuators[axis].get_controller_gains() for axis in _JOINT_ORDER]
        conditions = ImpactConditions(
            law=dataclasses.replace(
                ImpactLaw.of(self.scenario.contact.impact),
                stiffness=environment.impact_stiffness,
                exponent=environment.impact_exponent,
            ),
            shape=self._shape(environment.clearance),
            around=Surroundings.of([environment]),
            M=self._mass_matrix(plant_context),
            K=np.array([gain.p for gain in gains]),
            D=np.array([gain.d for gain in gains]),
        )
        self.impact.set_conditions(self.part_context(self.impact, context), conditions)

    def _shape(self, clearance: float) -> LockShape:
        """Returns the lock's shape with a clearance [m]."""
        return LockShape(dataclasses.replace(self.scenario.lock, clearance=clearance))

    def _mass_matrix(self, plant_context: Context) -> np.ndarray:
        """Returns the joints' mass matrix at their zero."""
        at_zero = self.plant.CreateDefaultContext()
        for actuator in self._actuators.values():
            inertia = actuator.rotor_inertia(plant_context)
            actuator.SetRotorInertia(at_zero, inertia)
        return self.plant.CalcMassMatrix(at_zero)

    def _add_sensor_joint(self, carrier: RigidBody) -> tuple[Frame, Joint]:
        X_BS = self.X_SB.inverse()
        plant, bolt = self.plant, self.lock.bolt
        on_carrier = plant.AddFrame(
            FixedOffsetFrame("carrier_sensor", carrier.body_frame(), X_BS)
        )
        frame_S = plant.AddFrame(FixedOffsetFrame("sensor", bolt.body_frame(), X_BS))
        return frame_S, plant.WeldFrames(on_carrier, frame_S)

    def _read_payload(self, frame_S: Frame) -> None:
        M_B = self.lock.bolt.default_spatial_inertia()
        self.payload_mass = M_B.get_mass()
        self.p_SoScm_S = self.X_SB @ M_B.get_com()

    def _wire_commands(self, builder: DiagramBuilder, carrier: RigidBody) -> None:
        """Commands place and rate; carries the bolt's weight as an arm would."""
        plant, instance = self.plant, carrier.model_instance()
        desired = builder.AddNamedSystem("desired_state", Multiplexer([6, 6]))
        builder.ExportInput(desired.get_input_port(0), "bolt.position")
        builder.ExportInput(desired.get_input_port(1), "bolt.velocity")
        weight = plant.CalcGravityGeneralizedForces(plant.CreateDefaultContext())
        carried = builder.AddNamedSystem("carried", ConstantVectorSource(-weight))
        measured = builder.AddNamedSystem("measured", Demultiplexer([6, 6]))
        connect = builder.Connect
        connect(desired.get_output_port(), plant.get_desired_state_input_port(instance))
        connect(carried.get_output_port(), plant.get_actuation_input_port(instance))
        connect(plant.get_state_output_port(instance), measured.get_input_port())
        builder.ExportOutput(measured.get_output_port(0), "bolt.position_measured")

    def _fix_commands(self, context: Context) -> None:
        super()._fix_commands(context)
        self.GetInputPort("bolt.velocity").FixValue(context, np.zeros(6))


def _axis_joint(axis: int, parent: Frame, child: Frame) -> Joint:
    kind = PrismaticJoint if axis < 3 else RevoluteJoint
    return kind(f"axis_{axis}", parent, child, _AXES[axis % 3])


def _inertia(twin: TwinConfig, axis: int) -> float:
    """Returns what an axis moves beside the bolt [kg or kg m^2]."""
    return twin.mass if axis < 3 else twin.inertia


def _gains(twin: TwinConfig, axis: int) -> PdControllerGains:
    k = twin.stiffness[axis]
    d = 2.0 * twin.damping_ratio * np.sqrt(k * _inertia(twin, axis))
    return PdControllerGains(p=k, d=d)


def _structure(scenario: Scenario) -> Scenario:
    """Returns a scenario without what the station can take in place."""
    return dataclasses.replace(
        scenario,
        name="",
        effects=[],
        randomisation=[],
        twin=TwinConfig(),
        contact=dataclasses.replace(
            _without(scenario.contact, _MATERIAL_FIELDS), impact=ImpactConfig()
        ),
        lock=_without(scenario.lock, GROOVE_FIELDS),
    )


def _without(section: Any, names: tuple[str, ...]) -> Any:
    """Returns a section of a scenario with some of its numbers at zero."""
    return dataclasses.replace(section, **dict.fromkeys(names, 0.0))
