"""The cell: arm, sensor, gripper, bench and lock in one MultibodyPlant."""

from collections.abc import Sequence

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    BodyIndex,
    PdControllerGains,
    SpatialInertia,
)
from pydrake.systems.controllers import InverseDynamics
from pydrake.systems.framework import Context, DiagramBuilder, OutputPort
from pydrake.systems.primitives import (
    Adder,
    ConstantVectorSource,
    Demultiplexer,
    MatrixGain,
    PassThrough,
    StateInterpolatorWithDiscreteDerivative,
)

from drake_disasm.cell.arm_control import joint_gains
from drake_disasm.cell.arm_dynamics import ArmDynamics
from drake_disasm.cell.arm_wrench import ArmWrench
from drake_disasm.cell.grip import AXIS_ORDER, finger_springs
from drake_disasm.devices.load_source import JointReaction, JointTorques
from drake_disasm.effects import ArmEffect
from drake_disasm.scenario import Scenario
from drake_disasm.stations.arm_mechanics import ArmMechanics, refuse_unknown_arm_effects
from drake_disasm.stations.base import refuse_twins_contact
from drake_disasm.stations.cell_models import add_adaptive_fingers, add_cell, hang_bolt
from drake_disasm.stations.contact import exclude_collisions
from drake_disasm.stations.simulated import SimulatedStation
from drake_disasm.stations.six_axis_spring import SixAxisSpring
from drake_disasm.stations.start_collisions import refuse_collisions
from drake_disasm.stations.wiring import (
    export_ready_device,
    export_required,
    reaction_ports,
)
from drake_disasm.systems.cartesian_impedance import CartesianImpedance

_PAD_INDENTATION = 3e-5  # m, of a pad (20 MPa, 7.5 mm thick) under some 60 N
_FINGER_MASS = 0.3  # kg, of a finger with its drive, for its damping


class CellStation(SimulatedStation):
    """Arm, force/torque sensor and gripper at the door-chain lock.

    By default a KUKA iiwa 14, an OnRobot HEX-E and a Robotiq 2F-140. The arm's ports
    have its name, `arm`, for which "iiwa" stands here.

    Position and joint impedance control are a spring and damper in each joint about
    the commanded angle, which the discrete solver takes implicitly, Cartesian
    impedance control one at the bolt (CartesianImpedance); plus gravity compensation
    by Drake's InverseDynamics with the tool's data. That is what KUKA's modes feel
    like from outside, the stiffness of position mode being that of the drives. The
    fingers are position-controlled likewise.

    Attributes:
        arm_instance: model instance of the arm in the plant.

    @system
    name: CellStation
    input_ports:
    - iiwa.position
    - gripper.position
    - applied_spatial_force
    output_ports:
    - iiwa.position_commanded
    - iiwa.position_measured
    - iiwa.velocity_estimated
    - iiwa.torque_commanded
    - iiwa.torque_measured
    - iiwa.torque_external
    - iiwa.health
    - iiwa.time_measured
    - gripper.state_measured
    - gripper.health
    - gripper.time_measured
    - ft_sensor.wrench
    - ft_sensor.health
    - ft_sensor.time_measured
    - bolt_pose
    - bolt_pose_in_groove
    - contact_results
    - query_object
    @endsystem
    """

    kind = "cell"
    has_velocity_input = False
    grip_command: float
    settling_time = 0.5

    def __init__(self, scenario: Scenario) -> None:
        super().__init__(scenario)
        refuse_twins_contact(scenario)
        self._set_arm()
        self.grip_command = _grip_command(scenario)
        self.tool = self._set_cell_geometry()
        self._dynamics = ArmDynamics(scenario.arm, self.tool, self.X_WG)
        builder = DiagramBuilder()
        self._build(builder)

    def _build(self, builder: DiagramBuilder) -> None:
        config = self.scenario
        frame_Gn = self._add_plant(builder, config.simulation.cell_time_step)
        plant = self.plant
        self._models = models = add_cell(
            plant, frame_Gn, config, self._environment, self._is_welded
        )
        self.arm_instance = models.arm.instance
        self.tool_models, self.lock = models.tool, models.lock
        # A groove that is tilted sinks into the bench, and the bolt in it.
        inside = self.lock.bolt_ids.values()
        exclude_collisions(self.scene_graph, inside, models.bench)
        effects = [e for e in self._default_effects if isinstance(e, ArmEffect)]
        self._mechanics = ArmMechanics(plant, models.arm, effects)
        compliance = self._add_compliance()
        plant.Finalize()
        self._set_gains()
        measured = self._wire_arm(builder)
        self._wire_gripper(builder)
        if compliance:
            self._wire_compliance(builder, compliance)
        if models.sensor:
            source = JointReaction(models.sensor.joint, models.sensor.frame_S)
            self._add_sensor(builder, source, reaction_ports(plant))
        else:
            arm, n = ArmWrench(config.arm), len(self.joints)
            torques = JointTorques(arm, n, self.time_step)
            self._add_sensor(builder, torques, measured)
        self._finish(builder)

    @property
    def _is_welded(self) -> bool:
        """Whether fingers are fixed to the bolt."""
        gripper = self.scenario.gripper
        return bool(gripper.fingers) and gripper.hold == "weld"

    @property
    def _is_apart(self) -> bool:
        """Whether the bolt is held by friction alone."""
        gripper = self.scenario.gripper
        return bool(gripper.fingers) and gripper.hold == "friction"

    def _add_compliance(self) -> SixAxisSpring | None:
        """Adds the springs of the gripper, if it has any."""
        gripper = self.scenario.gripper
        if gripper.compliance == "rigid":
            return None
        springs = finger_springs(gripper, self.tool)
        if gripper.fingers:
            return add_adaptive_fingers(self.plant, self.tool_models, springs)
        instance = self.tool_models.gripper
        of_bolt, of_tool = (
            [g for b in bodies for g in self.plant.GetCollisionGeometriesForBody(b)]
            for bodies in (
                [self.lock.bolt],
                map(self.plant.get_body, self.plant.GetBodyIndices(instance)),
            )
        )
        exclude_collisions(self.scene_graph, of_bolt, of_tool)
        p_BoTo_B = self.tool.p_BoTo_B
        return hang_bolt(self.plant, self._models, springs, p_BoTo_B)

    def _set_gains(self) -> None:
        plant, gripper = self.plant, self.scenario.gripper
        self._dynamics.set_positions(self.start)
        inertia = np.diag(self._dynamics.mass_matrix())
        k_arm, d_arm = joint_gains(self.scenario.arm, inertia)
        joints = plant.GetJointActuatorIndices(self.arm_instance)
        for index, k, d in zip(joints, k_arm, d_arm, strict=True):
            _set_spring(plant, index, k, d)
        for index in plant.GetJointActuatorIndices(self.tool_models.gripper):
            k = gripper.finger_stiffness
            _set_spring(plant, index, k, 2.0 * np.sqrt(k * _FINGER_MASS))

    def _wire_arm(self, builder: DiagramBuilder) -> dict[str, OutputPort]:
        """Adds the arm's controller; returns what is measured of the joints."""
        plant, connect, n = self.plant, builder.Connect, len(self.joints)
        command = builder.AddNamedSystem("arm_command", PassThrough(n))
        export_required(
            builder,
            command.get_input_port(),
            f"{self.arm}.position",
            f"connect the commanded joint angles ({n},), station.start to stay there",
        )
        desired = builder.AddNamedSystem(
            "arm_interpolator",
            StateInterpolatorWithDiscreteDerivative(
                n, self.scenario.arm.control_period, suppress_initial_transient=True
            ),
        )
        connect(command.get_output_port(), desired.get_input_port())
        reading = self._wire_torques(builder, desired.get_output_port())
        position, velocity = self._in_halves(
            builder, "arm_state", plant.get_state_output_port(self.arm_instance)
        )
        torque = plant.get_net_actuation_output_port(self.arm_instance)
        measured = self._mechanics.wire(builder, position, velocity, torque)
        position, velocity = self._in_halves(builder, "arm_reading", reading)
        outputs = {
            "position_commanded": command.get_output_port(),
            "position_measured": position,
            "velocity_estimated": velocity,
            "torque_commanded": torque,
            "torque_measured": measured,
            "torque_external": self._external_torque(builder),
        }
        for quantity, port in outputs.items():
            builder.ExportOutput(port, f"{self.arm}.{quantity}")
        export_ready_device(builder, self.arm, self.time_step)
        return {"position": position, "velocity": velocity, "torque": measured}

    @staticmethod
    def _in_halves(
        builder: DiagramBuilder, name: str, state: OutputPort
    ) -> tuple[OutputPort, OutputPort]:
        """Returns ports of the positions (n,) and velocities (n,) of a state (2 n,)."""
        n = state.size() // 2
        halves = builder.AddNamedSystem(name, Demultiplexer([n, n]))
        builder.Connect(state, halves.get_input_port())
        return halves.get_output_port(0), halves.get_output_port(1)

    def _wire_torques(self, builder: DiagramBuilder, desired: OutputPort) -> OutputPort:
        """Adds encoders and controller; returns the port of what encoders read (2 n,).

        Springs about a desired state (2 n,), and gravity's part. Springs in the joints
        are the plant's own; gravity compensation is by the controller's own model of
        arm and tool.
        """
        plant, arm, connect = self.plant, self.arm_instance, builder.Connect
        state, goal = self._mechanics.wire_encoders(
            builder, plant.get_state_output_port(arm), desired
        )
        weight = builder.AddNamedSystem(
            "arm_gravity_compensation",
            InverseDynamics(self._dynamics.plant, InverseDynamics.kGravityCompensation),
        )
        connect(state, weight.get_input_port(0))
        actuation = plant.get_actuation_input_port(arm)
        if self.scenario.arm.control != "cartesian_impedance":
            connect(goal, plant.get_desired_state_input_port(arm))
            connect(weight.get_output_port(), actuation)
            return state
        spring = builder.AddNamedSystem(
            "arm_cartesian_impedance",
            CartesianImpedance(self.scenario.arm, self._dynamics, self.start),
        )
        connect(state, spring.GetInputPort("state"))
        connect(desired, spring.GetInputPort("desired_state"))
        torque = builder.AddNamedSystem("arm_torque", Adder(2, len(self.joints)))
        connect(weight.get_output_port(), torque.get_input_port(0))
        connect(spring.get_output_port(), torque.get_input_port(1))
        connect(torque.get_output_port(), actuation)
        return state

    def _external_torque(self, builder: DiagramBuilder) -> OutputPort:
        """Returns the port of what pushes on the arm, the bolt being part of its tool.

        Held by friction the bolt is a body apart: its weight comes as a contact
        force on the fingers and is taken off here, as the robot's tool data would.
        """
        contact = self.plant.get_generalized_contact_forces_output_port(
            self.arm_instance
        )
        if not self._is_apart:
            return contact
        X_FB, plant = self.tool.X_FB, self._dynamics.plant
        context = plant.CreateDefaultContext()
        for i in range(1, plant.num_bodies()):  # 0 is the world
            body = plant.get_body(BodyIndex(i))
            body.SetSpatialInertiaInBodyFrame(context, SpatialInertia.Zero())
        M_B = self.scenario.part.M_moved_B.ReExpress(X_FB.rotation())
        load = plant.GetBodyByName("tool")
        load.SetSpatialInertiaInBodyFrame(context, M_B.Shift(-X_FB.translation()))
        carried = builder.AddNamedSystem(
            "arm_bolt_weight",
            InverseDynamics(plant, InverseDynamics.kGravityCompensation, context),
        )
        adder = Adder(2, contact.size())
        external = builder.AddNamedSystem("arm_torque_external", adder)
        state = self.plant.get_state_output_port(self.arm_instance)
        builder.Connect(state, carried.get_input_port(0))
        builder.Connect(contact, external.get_input_port(0))
        builder.Connect(carried.get_output_port(), external.get_input_port(1))
        return external.get_output_port()

    def _wire_gripper(self, builder: DiagramBuilder) -> None:
        plant, gripper = self.plant, self.tool_models.gripper
        if not self.scenario.gripper.fingers:
            self._export_idle_gripper(builder)
            return
        halves = np.array([[0.5], [0.5], [0.0], [0.0]])
        fingers = builder.AddNamedSystem("gripper_fingers", MatrixGain(D=halves))
        export_required(
            builder,
            fingers.get_input_port(),
            "gripper.position",
            "connect the commanded opening, [station.grip_command] to hold the bolt",
        )
        builder.Connect(
            fingers.get_output_port(), plant.get_desired_state_input_port(gripper)
        )
        sums = np.array([[1.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 1.0]])
        opening = builder.AddNamedSystem("gripper_opening", MatrixGain(D=sums))
        builder.Connect(plant.get_state_output_port(gripper), opening.get_input_port())
        builder.ExportOutput(opening.get_output_port(), "gripper.state_measured")
        export_ready_device(builder, "gripper", self.time_step)

    def _export_idle_gripper(self, builder: DiagramBuilder) -> None:
        """Exports the ports of a gripper that can't open: commands are ignored."""
        ignored = builder.AddNamedSystem("gripper_ignored", PassThrough(1))
        builder.ExportInput(ignored.get_input_port(), "gripper.position")
        shut = builder.AddNamedSystem("gripper_shut", ConstantVectorSource(np.zeros(2)))
        builder.ExportOutput(shut.get_output_port(), "gripper.state_measured")
        export_ready_device(builder, "gripper", self.time_step)

    def _wire_compliance(self, builder: DiagramBuilder, spring: SixAxisSpring) -> None:
        """Lets the springs rest where the bolt is gripped, weight included.

        The gripper closes about a bolt that is in its place: the springs carry fingers
        and bolt as they hang at the start, and yield to what changes.
        """
        plant, instance = self.plant, spring.instance
        name = plant.GetModelInstanceName(instance)
        rest = builder.AddNamedSystem(
            f"{name}_rest", ConstantVectorSource(np.zeros(12))
        )
        carried = builder.AddNamedSystem(
            f"{name}_load", ConstantVectorSource(self._weight_on_springs())
        )
        builder.Connect(
            rest.get_output_port(), plant.get_desired_state_input_port(instance)
        )
        builder.Connect(
            carried.get_output_port(), plant.get_actuation_input_port(instance)
        )

    def _weight_on_springs(self) -> np.ndarray:
        """Returns the forces (6,) that keep what the springs hold where it is at A."""
        M_B, g_W = self.tool.M_gripped_B, self.g_W
        R_BW = self.X_WG.rotation().inverse().matrix()  # B coincides with G there
        f_B = M_B.get_mass() * (R_BW @ g_W)
        p_ToCm_B = M_B.get_com() - self.tool.p_BoTo_B
        wrench = np.concatenate([f_B, np.cross(p_ToCm_B, f_B)])
        return -wrench[list(AXIS_ORDER)]

    def _refuse_arm_effects(self, effects: Sequence[ArmEffect]) -> None:
        refuse_unknown_arm_effects(effects)

    def _set_arm_effects(self, context: Context, effects: Sequence[ArmEffect]) -> None:
        self._mechanics.set_effects(effects, self._parts(context))

    def _take_as_default(self, settled: Context) -> None:
        """Lets the arm begin with the friction that it has come to rest with."""
        self._mechanics.take_as_default(self._parts(settled))

    def _unsettle(self, context: Context) -> None:
        self._mechanics.forget(self._parts(context))

    def _fix_commands(self, context: Context) -> None:
        super()._fix_commands(context)
        self.GetInputPort("gripper.position").FixValue(context, self.grip_command)

    def _refuse_bad_start(self) -> None:
        context = self.CreateDefaultContext()
        self._place_at_start(self.part_context(self.plant, context))
        query = self.GetOutputPort("query_object").Eval(context)
        refuse_collisions(self.plant, query, self._models)

    def _place_at_start(self, plant_context: Context) -> None:
        plant = self.plant
        plant.SetPositions(plant_context, self.arm_instance, self.start)
        for finger in self.tool_models.fingers:
            finger.set_translation(plant_context, self._start_opening / 2)
        if self._is_apart:
            plant.SetFreeBodyPose(plant_context, self.lock.bolt, self.X_WG)

    @property
    def _start_opening(self) -> float:
        """Where the pads stand at first: already pressed in by the grip force.

        From a mere touch both would hit the light bolt at speed and throw it.
        """
        pressed = self.scenario.part.grip_width - 2.0 * _PAD_INDENTATION
        return max(self.grip_command, pressed)


def _grip_command(scenario: Scenario) -> float:
    """Returns the opening [m] to command so that the pads press with the grip force.

    Fingers yield like springs (the real drive is self-locking), so they are
    sent to a place inside the grip. A welded bolt is only touched. Without fingers it
    is 0.
    """
    gripper, width = scenario.gripper, scenario.part.grip_width
    if not gripper.fingers:
        return 0.0
    if gripper.hold == "weld":
        return width + 0.002
    return width - 2.0 * gripper.grip_force / gripper.finger_stiffness


def _set_spring(plant: MultibodyPlant, index: int, k: float, d: float) -> None:
    actuator = plant.get_joint_actuator(index)
    actuator.set_controller_gains(PdControllerGains(p=k, d=d))
