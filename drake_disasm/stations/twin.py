"""The digital twin: bolt, groove and contact alone."""

import numpy as np
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    Frame,
    Joint,
    PdControllerGains,
    PrismaticJoint,
    RevoluteJoint,
    RigidBody,
    SpatialInertia,
)
from pydrake.systems.framework import Context, DiagramBuilder
from pydrake.systems.primitives import (
    ConstantVectorSource,
    Demultiplexer,
    Multiplexer,
)

from drake_disasm.coordinates import BoltCoordinates
from drake_disasm.lock import add_lock
from drake_disasm.ports import TWIN_PORTS
from drake_disasm.scenario import Scenario
from drake_disasm.stations.simulated import SimulatedStation
from drake_disasm.tool import Tool

_AXES = np.eye(3)


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
        instance = plant.AddModelInstance("carrier")
        parent, body = frame_Gn, None
        inertia = [twin.mass] * 3 + [twin.inertia] * 3
        for axis in (0, 1, 2, 5, 4, 3):
            body = plant.AddRigidBody(f"axis_{axis}", instance, SpatialInertia.Zero())
            joint = plant.AddJoint(_axis_joint(axis, parent, body.body_frame()))
            actuator = plant.AddJointActuator(f"axis_{axis}", joint)
            actuator.set_default_rotor_inertia(inertia[axis])
            actuator.set_default_gear_ratio(1.0)
            k = twin.stiffness[axis]
            d = 2.0 * twin.damping_ratio * np.sqrt(k * inertia[axis])
            actuator.set_controller_gains(PdControllerGains(p=k, d=d))
            parent = body.body_frame()
        assert body is not None
        return body

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
