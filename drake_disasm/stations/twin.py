"""The digital twin: bolt, groove and contact alone."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.tree import FixedOffsetFrame, Frame, WeldJoint
from pydrake.systems.framework import Context, DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, Demultiplexer, PassThrough

from drake_disasm.cell.coordinates import BoltCoordinates
from drake_disasm.cell.grip import deflection
from drake_disasm.cell.tool import summed
from drake_disasm.cell.twin_parameters import twin_of
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.ports import TWIN_PORTS
from drake_disasm.devices.load_source import JointReaction
from drake_disasm.effects import ArmEffect
from drake_disasm.effects.refusals import refuse_arm_effects
from drake_disasm.parts import ImpactConfig
from drake_disasm.scenario import (
    ArmConfig,
    GripperConfig,
    Scenario,
    validate,
)
from drake_disasm.stations.arm_node import ArmNode
from drake_disasm.stations.cell_models import add_weighed_lock
from drake_disasm.stations.contact import ContactStrategy, ImpactContactForce
from drake_disasm.stations.simulated import SimulatedStation
from drake_disasm.stations.six_axis_spring import SixAxisSpring
from drake_disasm.stations.wiring import (
    export_ready_device,
    export_required,
    reaction_ports,
)
from drake_disasm.systems.bolt_environment import BoltEnvironment
from drake_disasm.systems.optional_input import OptionalInput
from drake_disasm.twin.arm_step import ArmStep
from drake_disasm.twin.plant import SETTLING_TIME

_MATERIAL_FIELDS = ("friction", "modulus", "head_modulus", "dissipation")
_SPRING_FIELDS = (
    "stiffness",
    "damping_ratio",
    "finger_stiffness",
    "joint_impedance",
    "cartesian_impedance",
)


class TwinStation(SimulatedStation):
    """The thesis's twin: the command moves the bolt through arm and gripper.

    Its numbers are `twin_of(scenario)`. The arm under its controller is a linear
    system (`ArmNode`); where it is, is `bolt.position_measured`, as encoders see it.
    Behind it is the gripper's six-axis spring, of joints along x, y, z and about z, x,
    y from Gn in the middle of the pads, which the solver takes implicitly: what it
    gives by, no encoder sees. Bolt and fingers hang on it by a weld at S whose
    reaction is the load on a sensor in the wrist, and what is estimated without one, so
    the readings mean the same as the cell's and pass the same processing. While
    `bolt.velocity` is not connected it is zero.

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
    - bolt_pose_in_groove
    - contact_results
    - query_object
    @endsystem
    """

    kind = "twin"
    table = TWIN_PORTS
    arm = "bolt"
    has_velocity_input = True
    settling_time = SETTLING_TIME

    def __init__(self, scenario: Scenario) -> None:
        super().__init__(scenario)
        self.control_period = scenario.simulation.twin_time_step
        self.parameters = twin_of(scenario)
        self.X_SB, p_BoTo_B = self.parameters.X_SB, self.parameters.p_BoTo_B
        self.coordinates, self.start = BoltCoordinates(p_BoTo_B), np.zeros(6)
        self._is_reconfigured = False
        builder = DiagramBuilder()
        self._build(builder)

    def can_reconfigure(self, scenario: Scenario) -> bool:
        """Returns whether `reconfigure` can turn this station into another's."""
        return _structure(scenario) == _structure(self.scenario)

    def reconfigure(self, context: Context, scenario: Scenario) -> None:
        """Changes this station to another scenario without a rebuild.

        Identification asks for hundreds of parameter sets; in place, one costs a few
        milliseconds and leaves nothing behind, and every bit is as after a rebuild.
        Springs and dampers belong to the plant, not to the Context: a station that
        is reconfigured serves one Context, and its default Context is no longer the
        start of the task.

        Args:
            context: this station's; its time and state stay as they are.
            scenario: may differ in effects, in what the contact is made of, in
                the groove's dimensions, and in stiffness and damping of arm and grip.

        Raises:
            DisasmError: the scenario is out of bounds, or differs elsewhere.
        """
        validate(scenario)
        if not self.can_reconfigure(scenario):
            raise DisasmError(
                "the twin can't take this scenario in place; build a station of it"
            )
        self.scenario, self._initial = scenario, None
        self.parameters = twin_of(scenario)
        self._is_reconfigured = True
        self.lock = dataclasses.replace(
            self.lock, part=scenario.part, contact=scenario.contact
        )
        self._prepare(context)
        self.set_effects(context, scenario.effects)

    def deflection(self, wrench: np.ndarray) -> np.ndarray:
        """Returns by how much the grip gives (6,), in coordinates, under a wrench.

        At rest, bolt against arm; no encoder sees it.

        Args:
            wrench: (6,) on the bolt at Bo in Gn, [f; tau], processed as the task's.
        """
        parameters = self.parameters
        weight = self.X_WG.rotation().inverse() @ (self._moved_mass * self.g_W)
        found = deflection(parameters.grip, parameters.p_BoTo_B, weight, wrench)
        return np.asarray(found)

    def _take_as_default(self, settled: Context) -> None:
        """Lets the arm begin where it has given way to a load on the bolt."""
        arm = self.arm_node.system
        state = self.part_context(arm, settled).get_discrete_state_vector()
        arm.configure_default_state(state.CopyToVector())

    def _unsettle(self, context: Context) -> None:
        arm = self.part_context(self.arm_node.system, context)
        arm.SetDiscreteState(np.zeros(12))

    def _prepare(self, context: Context) -> None:
        if not self._is_reconfigured:
            return
        self.contact.reconfigure(self.lock, self._parts(context))
        step = self._arm_step()
        self._spring.set_springs(step.springs)
        self.arm_node.set_step(step)

    def _build(self, builder: DiagramBuilder) -> None:
        scenario = self.scenario
        frame_Gn = self._add_plant(builder, scenario.simulation.twin_time_step)
        plant = self.plant
        under, self.lock = add_weighed_lock(
            plant, frame_Gn, scenario, self._environment
        )
        p_BoTo_B, springs = self.parameters.p_BoTo_B, self._arm_step().springs
        frame_Tn = plant.AddFrame(
            FixedOffsetFrame("grip_nominal", frame_Gn, RigidTransform(p_BoTo_B))
        )
        self._spring = SixAxisSpring(plant, "grip", frame_Tn, springs)
        source = JointReaction(*self._add_sensor_joint(), self._sensor_mount)
        if under:
            source = JointReaction(under.joint, under.frame_S)
        plant.Finalize()
        self._read_payload()
        self._wire_commands(builder)
        inputs = reaction_ports(plant)
        if not under:
            measured = builder.GetSubsystemByName("measured").get_output_port(0)
            inputs |= {"mount_coordinates": measured}
        self._add_sensor(builder, source, inputs)
        export_ready_device(builder, "bolt", self.time_step)
        self._finish(builder)

    def _make_contact(self, surroundings: BoltEnvironment) -> ContactStrategy:
        if self.scenario.contact.model == "hydroelastic":
            return super()._make_contact(surroundings)
        return ImpactContactForce(
            self.plant,
            self.scene_graph,
            self.lock,
            surroundings,
            spring=self._spring,
            R_WGn=self.X_WG.rotation(),
            p_BoTo_B=self.parameters.p_BoTo_B,
            time_step=self.time_step,
            environment=self._environment,
            is_weighed=self.X_GS is not None,
        )

    def _refuse_arm_effects(self, effects: Sequence[ArmEffect]) -> None:
        refuse_arm_effects(effects)

    def _add_sensor_joint(self) -> tuple[WeldJoint, Frame]:
        """Hangs bolt and fingers on the springs; returns the weld there, and S."""
        plant, bolt = self.plant, self.lock.bolt
        X_TB = RigidTransform(self.parameters.p_BoTo_B).inverse()
        X_BS = self.X_SB.inverse()
        on_spring = plant.AddFrame(
            FixedOffsetFrame(
                "sprung_sensor", self._spring.last.body_frame(), X_TB @ X_BS
            )
        )
        frame_S = plant.AddFrame(FixedOffsetFrame("sensor", bolt.body_frame(), X_BS))
        fingers = plant.AddRigidBody(
            "fingers", self._spring.instance, self.parameters.M_fingers_B
        )
        plant.WeldFrames(bolt.body_frame(), fingers.body_frame())
        return plant.WeldFrames(on_spring, frame_S), frame_S

    def _read_payload(self) -> None:
        """Sets what the sensor carries: bolt and fingers, if it is in the wrist."""
        bolt = self.lock.bolt.default_spatial_inertia()
        M_B = summed([bolt, self.parameters.M_fingers_B])
        self._moved_mass = M_B.get_mass()
        self._set_payload(self._moved_mass, self.X_SB @ M_B.get_com())

    def _sensor_mount(self, coordinates: np.ndarray) -> RigidTransform:
        """Returns X_WS of a sensor before the springs, by the arm's coordinates."""
        return self.X_WG @ self.coordinates.pose(coordinates) @ self.X_SB.inverse()

    def _wire_commands(self, builder: DiagramBuilder) -> None:
        """Commands place and rate; carries the weight behind the springs."""
        plant, instance = self.plant, self._spring.instance
        connect = builder.Connect
        place = builder.AddNamedSystem("commanded_place", PassThrough(6))
        rate = builder.AddNamedSystem("commanded_rate", OptionalInput(np.zeros(6)))
        export_required(
            builder,
            place.get_input_port(),
            "bolt.position",
            "connect the commanded coordinates (6,), station.start to stay there",
        )
        builder.ExportInput(rate.get_input_port(), "bolt.velocity")
        self.arm_node = ArmNode(
            builder,
            self._arm_step(),
            self.time_step,
            (
                place.get_output_port(),
                rate.get_output_port(),
                plant.get_state_output_port(instance),
            ),
        )
        weight = plant.CalcGravityGeneralizedForces(plant.CreateDefaultContext())
        carried = builder.AddNamedSystem("carried", ConstantVectorSource(-weight))
        measured = builder.AddNamedSystem("measured", Demultiplexer([6, 6]))
        connect(self.arm_node.ahead, plant.get_desired_state_input_port(instance))
        connect(carried.get_output_port(), plant.get_actuation_input_port(instance))
        connect(self.arm_node.state, measured.get_input_port())
        builder.ExportOutput(measured.get_output_port(0), "bolt.position_measured")

    def _arm_step(self) -> ArmStep:
        parameters = self.parameters
        step = ArmStep.of(parameters.arm, parameters.grip, self.time_step)
        if not step.is_stable:
            raise DisasmError(
                f"simulation.twin_time_step: {self.time_step:g} s is too long for this "
                "arm behind so stiff a grip; give less"
            )
        return step


def _structure(scenario: Scenario) -> Scenario:
    """Returns a scenario without what the station can take in place."""
    return dataclasses.replace(
        scenario,
        name="",
        effects=[],
        randomisation=[],
        arm=_without_springs(scenario.arm, ArmConfig()),
        gripper=_without_springs(scenario.gripper, GripperConfig()),
        contact=dataclasses.replace(
            _without(scenario.contact, _MATERIAL_FIELDS), impact=ImpactConfig()
        ),
        part=_without(scenario.part, scenario.part.fixed_fields),
    )


def _without_springs(section: Any, nominal: Any) -> Any:
    """Returns a section with the nominal's numbers for stiffness and damping."""
    names = [f.name for f in dataclasses.fields(section) if f.name in _SPRING_FIELDS]
    return dataclasses.replace(section, **{n: getattr(nominal, n) for n in names})


def _without(section: Any, names: tuple[str, ...]) -> Any:
    """Returns a section of a scenario with some of its numbers at zero."""
    return dataclasses.replace(section, **dict.fromkeys(names, 0.0))
