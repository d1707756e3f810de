"""The digital twin: bolt, groove and contact alone."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
from pydrake.multibody.tree import FixedOffsetFrame, Frame, WeldJoint
from pydrake.systems.framework import Context, DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, Demultiplexer, Multiplexer

from drake_disasm.cell.coordinates import BoltCoordinates
from drake_disasm.cell.lock import add_lock, nominal_environment
from drake_disasm.cell.lock_dimensions import GROOVE_FIELDS
from drake_disasm.cell.tool import Tool
from drake_disasm.common.errors import DisasmError
from drake_disasm.effects import ArmEffect
from drake_disasm.impact import ImpactConditions
from drake_disasm.ports import TWIN_PORTS
from drake_disasm.scenario import ImpactConfig, Scenario, TwinConfig, validate
from drake_disasm.stations.capabilities import refuse_arm_effects
from drake_disasm.stations.carrier import Carrier
from drake_disasm.stations.contact import ContactStrategy, ImpactContactForce
from drake_disasm.stations.simulated import SimulatedStation
from drake_disasm.stations.wiring import export_ready_device, export_required
from drake_disasm.systems.optional_input import OptionalInput
from drake_disasm.systems.outside_force import OutsideForce

_MATERIAL_FIELDS = ("friction", "modulus", "head_modulus", "dissipation")


class TwinStation(SimulatedStation):
    """The thesis's twin: the command moves the bolt through a six-axis spring.

    A carrier in Gn has six joints (x, y, z, then yaw, pitch and roll) whose
    controllers are the stiffness and damping of arm, gripper and sensor; the
    solver takes them implicitly. The bolt hangs on the carrier by a weld at S
    whose reaction is the sensor's load, so the readings mean the same as the
    cell's and pass the same processing. While `bolt.velocity` is not connected it is
    zero.

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
                the groove's dimensions, and in the section `twin`.

        Raises:
            DisasmError: the scenario is out of bounds, or differs elsewhere.
        """
        validate(scenario)
        if not self.can_reconfigure(scenario):
            raise DisasmError(
                "the twin can't take this scenario in place; build a station of it"
            )
        self.scenario, self._initial = scenario, None
        self._is_reconfigured = True
        self.lock = dataclasses.replace(
            self.lock,
            config=scenario.lock,
            nominal=nominal_environment(scenario.lock, scenario.contact),
        )
        self._prepare(context)
        self.set_effects(context, scenario.effects)

    def impact_conditions(self, context: Context) -> ImpactConditions:
        """Returns the present inputs of the IMPACT law.

        Raises:
            DisasmError: the contact is hydroelastic.
        """
        if not isinstance(self.contact, ImpactContactForce):
            raise DisasmError("contact.model: is hydroelastic; set it to impact")
        system = self.contact.system
        return system.conditions(self.part_context(system, context))

    def _prepare(self, context: Context) -> None:
        if not self._is_reconfigured:
            return
        scenario = self.scenario
        self.contact.reconfigure(self.lock, scenario.contact, self._parts(context))
        plant_context = self.part_context(self.plant, context)
        self._carrier.set_springs(scenario.twin, plant_context)

    def _build(self, builder: DiagramBuilder) -> None:
        scenario = self.scenario
        frame_Gn = self._add_plant(builder, scenario.simulation.twin_time_step)
        plant = self.plant
        self.lock = add_lock(
            plant, frame_Gn, scenario.lock, scenario.contact, self._environment
        )
        self._carrier = Carrier(plant, frame_Gn, scenario.twin)
        frame_S, joint = self._add_sensor_joint()
        plant.Finalize()
        self._read_payload()
        self._wire_commands(builder)
        self._add_sensor(builder, joint, frame_S)
        export_ready_device(builder, "bolt", self.time_step)
        self._finish(builder)

    def _make_contact(self, outside_force: OutsideForce) -> ContactStrategy:
        if self.scenario.contact.model == "hydroelastic":
            return super()._make_contact(outside_force)
        return ImpactContactForce(
            self.plant,
            self.scene_graph,
            self.lock,
            outside_force,
            carrier=self._carrier,
            R_WGn=self.X_WG.rotation(),
            time_step=self.time_step,
            contact=self.scenario.contact,
            environment=self._environment,
        )

    def _refuse_arm_effects(self, effects: Sequence[ArmEffect]) -> None:
        refuse_arm_effects(effects)

    def _add_sensor_joint(self) -> tuple[Frame, WeldJoint]:
        X_BS = self.X_SB.inverse()
        plant, bolt = self.plant, self.lock.bolt
        on_carrier = plant.AddFrame(
            FixedOffsetFrame("carrier_sensor", self._carrier.body.body_frame(), X_BS)
        )
        frame_S = plant.AddFrame(FixedOffsetFrame("sensor", bolt.body_frame(), X_BS))
        return frame_S, plant.WeldFrames(on_carrier, frame_S)

    def _read_payload(self) -> None:
        M_B = self.lock.bolt.default_spatial_inertia()
        self.payload_mass = M_B.get_mass()
        self.p_SoScm_S = self.X_SB @ M_B.get_com()

    def _wire_commands(self, builder: DiagramBuilder) -> None:
        """Commands place and rate; carries the bolt's weight as an arm would."""
        plant, instance = self.plant, self._carrier.instance
        connect = builder.Connect
        desired = builder.AddNamedSystem("desired_state", Multiplexer([6, 6]))
        rate = builder.AddNamedSystem("commanded_rate", OptionalInput(np.zeros(6)))
        export_required(
            builder,
            desired.get_input_port(0),
            "bolt.position",
            "connect the commanded coordinates (6,), station.start to stay there",
        )
        builder.ExportInput(rate.get_input_port(), "bolt.velocity")
        connect(rate.get_output_port(), desired.get_input_port(1))
        weight = plant.CalcGravityGeneralizedForces(plant.CreateDefaultContext())
        carried = builder.AddNamedSystem("carried", ConstantVectorSource(-weight))
        measured = builder.AddNamedSystem("measured", Demultiplexer([6, 6]))
        connect(desired.get_output_port(), plant.get_desired_state_input_port(instance))
        connect(carried.get_output_port(), plant.get_actuation_input_port(instance))
        connect(plant.get_state_output_port(instance), measured.get_input_port())
        builder.ExportOutput(measured.get_output_port(0), "bolt.position_measured")


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
