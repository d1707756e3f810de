"""What the simulated stations share."""

import copy
import functools
from collections.abc import Mapping, Sequence

import numpy as np
from pydrake.geometry import SceneGraph
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, DiagramBuilder, OutputPort, System
from pydrake.systems.primitives import RandomSource

from drake_disasm.cell.lock import Lock
from drake_disasm.cell.placement import nominal_groove_pose
from drake_disasm.common.ports import check_ports
from drake_disasm.devices.ft_sensor import ForceTorqueSensor
from drake_disasm.devices.load_source import LoadSource
from drake_disasm.effects import (
    ArmEffect,
    BoltMotion,
    Effect,
    environment_at,
    is_local,
    sensor_chain,
)
from drake_disasm.effects.refusals import refuse_unknown_kinds, refuse_without_quantity
from drake_disasm.scenario import Scenario, validate
from drake_disasm.stations.base import (
    InitialState,
    Parts,
    Station,
    add_nominal_groove,
)
from drake_disasm.stations.contact import (
    ContactStrategy,
    HydroelasticContact,
)
from drake_disasm.stations.local_effects import LocalEffectsMonitor
from drake_disasm.stations.wiring import add_plant, export_bolt_pose, wire_sensor
from drake_disasm.systems.bolt_environment import BoltEnvironment
from drake_disasm.systems.effects_in_force import EffectsInForce


class SimulatedStation(Station):
    """A station made of a MultibodyPlant; see CellStation and TwinStation.

    Its default Context is the start of the task, in any diagram: the bolt is gripped
    at A and rests there, with the scenario's effects in force. An optional input that
    is not connected is at rest.

    Besides the table's ports it has those of `simulation_only`: the outputs `bolt_pose`
    (X_GnB, true), `bolt_pose_in_groove` (X_GB), `contact_results` and `query_object`,
    and the input `applied_spatial_force`.
    """

    #: Time to settle at the start, before an episode begins [s].
    settling_time: float

    #: Of the discrete plant [s].
    time_step: float

    plant: MultibodyPlant
    scene_graph: SceneGraph
    lock: Lock
    contact: ContactStrategy
    sensor: ForceTorqueSensor
    sensor_noise: RandomSource

    def __init__(self, scenario: Scenario) -> None:
        super().__init__()
        validate(scenario)
        self.scenario = scenario
        # A copy, so that a later change to the scenario's list is detected.
        self._default_effects = copy.deepcopy(list(scenario.effects))
        self._acting_by_default = _acting(self._default_effects)
        self._nominal = scenario.part.environment(scenario.contact)
        self.refuse_effects(scenario.effects)
        self._environment = environment_at(self._nominal, scenario.effects)
        self._initial: InitialState | None = None

    def _add_plant(self, builder: DiagramBuilder, time_step: float) -> Frame:
        """Adds plant and scene graph; returns the groove's nominal frame."""
        self.time_step = time_step
        simulation = self.scenario.simulation
        self.plant, self.scene_graph = add_plant(builder, simulation, time_step)
        self.g_W = self.plant.gravity_field().gravity_vector()
        self.X_WG = nominal_groove_pose(self.scenario.placement)
        return add_nominal_groove(self.plant, self.X_WG)

    def _add_sensor(
        self,
        builder: DiagramBuilder,
        source: LoadSource,
        inputs: Mapping[str, OutputPort],
    ) -> None:
        """Adds the sensor of a source, whose ports read the inputs of their names."""
        config = self.scenario.ft_sensor
        self.sensor = ForceTorqueSensor(
            config,
            source,
            self.payload,
            self.time_step,
            sensor_chain(self.scenario.effects),
        )
        self.sensor_noise = wire_sensor(builder, self.sensor, inputs, config.period)

    def _finish(self, builder: DiagramBuilder) -> None:
        """Exports the simulation's own ports, builds, and settles."""
        plant = self.plant
        export_bolt_pose(builder, plant, self.lock, self.X_WG)
        builder.ExportOutput(plant.get_contact_results_output_port(), "contact_results")
        self._wire_applied_forces(builder)
        builder.ExportOutput(self.scene_graph.get_query_output_port(), "query_object")
        self._in_force = builder.AddNamedSystem(
            "effects_in_force", EffectsInForce(self._default_effects)
        )
        builder.BuildInto(self)
        check_ports(self, self.table)
        self._refuse_bad_start()
        self._settle_by_default()

    def _wire_applied_forces(self, builder: DiagramBuilder) -> None:
        """Exports the input for forces from outside; adds what pulls on the bolt."""
        R_WGn = self.X_WG.rotation()
        surroundings = builder.AddNamedSystem(
            "bolt_environment",
            BoltEnvironment(
                self.lock.bolt.index(), self.lock.part, R_WGn, self._environment
            ),
        )
        if self.lock.part.has_spring:
            truth = builder.GetSubsystemByName("bolt_pose").GetOutputPort("X_GB")
            builder.Connect(truth, surroundings.GetInputPort("X_GB"))
        port = surroundings.GetInputPort("applied_spatial_force")
        builder.ExportInput(port, "applied_spatial_force")
        self.contact = self._make_contact(surroundings)
        forces = self.contact.add_forces(builder, surroundings.get_output_port())
        applied = self.plant.get_applied_spatial_force_input_port()
        builder.Connect(forces, applied)

    def _make_contact(self, surroundings: BoltEnvironment) -> ContactStrategy:
        """Returns the contact strategy for bolt and groove."""
        return HydroelasticContact(
            self.plant, self.scene_graph, self.lock, surroundings
        )

    def _refuse_bad_start(self) -> None:
        """Raises DisasmError if bodies overlap where an episode starts."""

    def _settle_by_default(self) -> None:
        """Makes the settled start, with the scenario's effects, the default Context."""
        plant = self.plant
        unsettled = plant.CreateDefaultContext()
        self._place_at_start(unsettled)
        self._unsettled = plant.GetPositions(unsettled)
        settled = self.settled(self._default_effects)
        q = plant.GetPositions(self.part_context(plant, settled))
        plant.SetDefaultPositions(q)
        self._take_as_default(settled)
        self.sensor.set_load_at_rest(
            self.sensor.load(self.part_context(self.sensor, settled))
        )
        self._initial = self._state_at_start(settled)

    def _take_as_default(self, settled: Context) -> None:
        """Makes what has settled besides the plant a part of the default Context."""

    @property
    def initial_state(self) -> InitialState:
        """See Station."""
        if self._initial is None:
            settled = self.settled(self.scenario.effects)
            return self._state_at_start(settled)
        return self._initial

    def refuse_effects(self, effects: Sequence[Effect]) -> None:
        """See Station."""
        refuse_unknown_kinds(effects)
        self._refuse_arm_effects([e for e in effects if isinstance(e, ArmEffect)])
        refuse_without_quantity(self.scenario.contact.model, self._nominal, effects)

    def _refuse_arm_effects(self, effects: Sequence[ArmEffect]) -> None:
        """Raises DisasmError for effects on the arm that the station can't carry."""

    def set_effects(self, context: Context, effects: Sequence[Effect]) -> None:
        """Puts effects into this station's Context, without a rebuild.

        The state is unchanged: `settled` returns one that is consistent with them.

        Raises:
            DisasmError: the station can't carry one of them.
        """
        self.refuse_effects(effects)
        self._in_force.set(self.part_context(self._in_force, context), effects)
        arm = [effect for effect in effects if isinstance(effect, ArmEffect)]
        self._set_arm_effects(context, arm)
        self.contact.set_environment(
            environment_at(self.lock.environment, effects), self._parts(context)
        )
        self.sensor.set_effects(
            self.part_context(self.sensor, context), sensor_chain(effects)
        )

    def effects_in_force(self, context: Context) -> tuple[Effect, ...]:
        """Returns the effects that this station's Context has."""
        return self._in_force.get(self.part_context(self._in_force, context))

    def update_local_effects(
        self, context: Context, effects: Sequence[Effect], bolt: BoltMotion
    ) -> None:
        """Updates effects that depend on the bolt's motion, if there are any.

        Args:
            context: this station's, in which `effects` are set.
            effects: the same.
            bolt: its motion in the step to come.
        """
        if is_local(effects):
            environment = environment_at(self.lock.environment, effects, bolt)
            self.contact.change_environment(environment, self._parts(context))

    def attach(self, simulator: Simulator) -> None:
        """See Station."""
        simulator.set_monitor(LocalEffectsMonitor(self, simulator.get_monitor()))
        self._in_force.note_updated(simulator)

    def register_caller_updates(self, simulator: Simulator) -> None:
        """See Station."""
        self._in_force.note_updated(simulator)

    def register_motion_effects(self) -> None:
        """See Station."""
        self._in_force.motion_is_applied = True

    def _set_arm_effects(self, context: Context, effects: Sequence[ArmEffect]) -> None:
        """Puts these effects on the arm, and no others, into this station's Context."""

    def at_start(self, effects: Sequence[Effect]) -> Simulator:
        """Returns a simulator of this station alone, commanded to stay at A.

        Its Context is at time zero and not yet settled; `Initialize` it after any
        further change. Effects that depend on the bolt's motion act.
        """
        simulator = self._unsettled_simulator(effects)
        self.attach(simulator)
        return simulator

    def _unsettled_simulator(self, effects: Sequence[Effect]) -> Simulator:
        simulator = Simulator(self)
        context = simulator.get_mutable_context()
        self._prepare(context)
        self.set_effects(context, effects)
        plant_context = self.part_context(self.plant, context)
        self.plant.SetPositions(plant_context, self._unsettled)
        self._unsettle(context)
        self._fix_commands(context)
        return simulator

    def settled(self, effects: Sequence[Effect]) -> Context:
        """Returns a Context of this station alone: bolt gripped at A, at rest."""
        simulator = self._unsettled_simulator(effects)
        with self._in_force.at_rest():
            simulator.Initialize()
        simulator.AdvanceTo(self.settling_time)
        return simulator.get_mutable_context()

    @property
    def random_sources(self) -> tuple[RandomSource, ...]:
        """See Station."""
        return (self.sensor_noise,)

    def begin(
        self, context: Context, effects: Sequence[Effect] | None = None
    ) -> InitialState:
        """See Station: the bolt is gripped at A, at rest, and the sensor is zeroed.

        With the scenario's own effects that is the default Context.
        """
        wanted = list(self.scenario.effects if effects is None else effects)
        if self._initial is not None and _acting(wanted) == self._acting_by_default:
            self.SetDefaultContext(context)
            return self._initial
        settled = self.settled(wanted)
        self.set_effects(context, wanted)
        _copy_state(settled, context)
        self.sensor.forget(self.part_context(self.sensor, context))
        plant_context = self.part_context(self.plant, context)
        self.plant.SetVelocities(plant_context, np.zeros(self.plant.num_velocities()))
        return self._state_at_start(settled)

    def reading_at_zeroing(self, context: Context) -> np.ndarray:
        """Returns what the sensor reads, noise averaged away, (6,) [f; tau] in S."""
        return self.sensor.reading_at_zeroing(self.part_context(self.sensor, context))

    def _state_at_start(self, settled: Context) -> InitialState:
        load = self.sensor.load(self.part_context(self.sensor, settled))
        on_bolt = load - self.mounting.weight_at_start
        force = float(np.linalg.norm(on_bolt[:3]))
        return InitialState(self.start, self.reading_at_zeroing(settled), force)

    def true_groove_pose(self, context: Context) -> RigidTransform:
        """Returns X_GnG, where the groove truly is."""
        return self.lock.frame.GetPoseInParentFrame(
            self.part_context(self.plant, context)
        )

    def part_context(self, part: System, context: Context) -> Context:
        """Returns the Context of a part of this station from the station's own."""
        return self.GetMutableSubsystemContext(part, context)

    def _parts(self, context: Context) -> Parts:
        """Returns a function from a part to its Context within this station's."""
        return functools.partial(self.part_context, context=context)

    def _place_at_start(self, plant_context: Context) -> None:
        """Sets the positions from which settling starts, if not the default ones."""

    def _unsettle(self, context: Context) -> None:
        """Takes back what `_take_as_default` did, before settling anew."""

    def _prepare(self, context: Context) -> None:
        """Applies to a default Context what `reconfigure` has changed."""

    def _fix_commands(self, context: Context) -> None:
        """Commands the start, for a station that stands alone."""
        self.GetInputPort(f"{self.arm}.position").FixValue(context, self.start)


def _acting(effects: Sequence[Effect]) -> list[Effect]:
    return [effect for effect in effects if not effect.is_null]


def _copy_state(source: Context, target: Context) -> None:
    """Copies discrete and abstract state between Contexts of one system.

    Drake's own copy (SetTimeStateAndParametersFrom) takes root Contexts only, and
    a station's is a part of the diagram's.
    """
    target.get_mutable_discrete_state().SetFrom(source.get_discrete_state())
    values = target.get_mutable_abstract_state()
    for i in range(source.num_abstract_states()):
        values.get_mutable_value(i).SetFrom(source.get_abstract_state().get_value(i))
