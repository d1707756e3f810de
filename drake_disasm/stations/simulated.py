"""What the simulated stations share."""

from collections.abc import Sequence

import numpy as np
from pydrake.common import RandomDistribution
from pydrake.common.value import Value
from pydrake.geometry import SceneGraph
from pydrake.math import RigidTransform
from pydrake.multibody.plant import (
    AddMultibodyPlant,
    MultibodyPlant,
    MultibodyPlantConfig,
)
from pydrake.multibody.tree import Frame, RigidBody, WeldJoint
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiagramBuilder,
    LeafSystem,
    OutputPort,
    System,
)
from pydrake.systems.primitives import ConstantVectorSource, RandomSource

from drake_disasm.cell.lock import Lock, has_same_material, set_environment, set_pose
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.timing import newest_step
from drake_disasm.devices.ft_sensor import ForceTorqueSensor
from drake_disasm.effects import (
    ArmEffect,
    BoltMotion,
    Effect,
    Environment,
    environment_at,
    is_local,
    sensor_chain,
)
from drake_disasm.ports import Health, check_ports
from drake_disasm.scenario import Scenario, validate
from drake_disasm.stations.base import (
    InitialState,
    Station,
    add_nominal_groove,
    nominal_groove_pose,
)
from drake_disasm.systems.outside_force import OutsideForce


class SimulatedStation(Station):
    """A station made of a MultibodyPlant; see CellStation and TwinStation.

    Beside the table's ports it has what only a simulation knows: `bolt_pose`
    (X_GnB, true), `contact_results`, and the applied spatial forces input.
    """

    #: How long the station is left alone before an episode begins [s].
    settling_time: float

    #: Of the discrete plant [s].
    time_step: float

    plant: MultibodyPlant
    scene_graph: SceneGraph
    lock: Lock
    sensor: ForceTorqueSensor
    sensor_noise: RandomSource

    def __init__(self, scenario: Scenario) -> None:
        super().__init__()
        validate(scenario)
        self.scenario = scenario

    def _add_plant(self, builder: DiagramBuilder, time_step: float) -> Frame:
        """Adds plant and scene graph; returns the groove's nominal frame."""
        self.time_step = time_step
        simulation = self.scenario.simulation
        config = MultibodyPlantConfig(
            time_step=time_step,
            stiction_tolerance=simulation.stiction_tolerance,
            discrete_contact_approximation=simulation.contact_approximation,
            contact_model="hydroelastic_with_fallback",
        )
        self.plant, self.scene_graph = AddMultibodyPlant(config, builder)
        self.g_W = self.plant.gravity_field().gravity_vector()
        self.X_WG = nominal_groove_pose(self.scenario.placement)
        return add_nominal_groove(self.plant, self.X_WG)

    def _add_sensor(
        self, builder: DiagramBuilder, joint: WeldJoint, frame_S: Frame
    ) -> None:
        config, plant = self.scenario.ft_sensor, self.plant
        self.sensor = builder.AddNamedSystem(
            "ft_sensor",
            ForceTorqueSensor(
                config,
                joint.index(),
                frame_S.body().index(),
                frame_S.GetFixedPoseInBodyFrame(),
                self.payload,
                self.time_step,
            ),
        )
        self.sensor_noise = builder.AddNamedSystem(
            "ft_sensor_noise",
            RandomSource(RandomDistribution.kGaussian, 6, config.period),
        )
        connect = builder.Connect
        connect(
            plant.get_reaction_forces_output_port(),
            self.sensor.GetInputPort("reaction_forces"),
        )
        connect(
            plant.get_body_poses_output_port(), self.sensor.GetInputPort("body_poses")
        )
        connect(self.sensor_noise.get_output_port(), self.sensor.GetInputPort("noise"))
        for quantity in ("wrench", "health", "time_measured"):
            builder.ExportOutput(
                self.sensor.GetOutputPort(quantity), f"ft_sensor.{quantity}"
            )

    def _add_ready_device(self, builder: DiagramBuilder, name: str) -> None:
        """Exports health and sample time of a device that never fails."""
        ready = builder.AddNamedSystem(
            f"{name}_health", ConstantVectorSource([float(Health.READY)])
        )
        clock = builder.AddNamedSystem(f"{name}_clock", _Clock(self.time_step))
        builder.ExportOutput(ready.get_output_port(), f"{name}.health")
        builder.ExportOutput(clock.get_output_port(), f"{name}.time_measured")

    def _finish(self, builder: DiagramBuilder, bolt: RigidBody) -> None:
        """Exports the simulation's own ports, builds, and checks the table."""
        plant = self.plant
        truth = builder.AddNamedSystem(
            "bolt_pose", _BodyPose(int(bolt.index()), self.X_WG)
        )
        builder.Connect(plant.get_body_poses_output_port(), truth.get_input_port())
        builder.ExportOutput(truth.get_output_port(), "bolt_pose")
        builder.ExportOutput(plant.get_contact_results_output_port(), "contact_results")
        self._wire_applied_forces(builder)
        builder.ExportOutput(self.scene_graph.get_query_output_port(), "query_object")
        builder.BuildInto(self)
        check_ports(self, self.table)

    def _wire_applied_forces(self, builder: DiagramBuilder) -> None:
        """Exports the input for forces from outside; adds what pulls on the bolt."""
        self.outside_force = builder.AddNamedSystem(
            "outside_force",
            OutsideForce(self.lock.bolt.index(), self.X_WG.rotation()),
        )
        outside = self.outside_force.GetInputPort("applied_spatial_force")
        builder.ExportInput(outside, "applied_spatial_force")
        self._apply_forces(builder, self.outside_force.get_output_port())

    def _apply_forces(self, builder: DiagramBuilder, forces: OutputPort) -> None:
        """Connects what pulls on the bolt to the plant."""
        applied = self.plant.get_applied_spatial_force_input_port()
        builder.Connect(forces, applied)

    def set_effects(self, context: Context, effects: Sequence[Effect]) -> None:
        """Puts effects into this station's Context; nothing is rebuilt.

        The bolt stays where it was: `settled` gives a state that fits them.
        """
        arm = [effect for effect in effects if isinstance(effect, ArmEffect)]
        self._set_arm_effects(context, arm)
        self._set_environment(context, environment_at(self.lock.nominal, effects))
        self.sensor.set_effects(
            self.part_context(self.sensor, context),
            sensor_chain(effects),
        )

    def update_local_effects(
        self, context: Context, effects: Sequence[Effect], bolt: BoltMotion
    ) -> None:
        """Brings what depends on the bolt's motion up to date, if anything does.

        Args:
            context: this station's, in which `effects` are set.
            effects: the same.
            bolt: its motion in the step to come.
        """
        if is_local(effects):
            environment = environment_at(self.lock.nominal, effects, bolt)
            self._change_environment(context, environment)

    def _set_arm_effects(self, context: Context, effects: Sequence[ArmEffect]) -> None:
        """Puts an arm's effects, and no others, into this station's Context.

        Raises:
            DisasmError: the station has no arm.
        """
        if effects:
            raise DisasmError(
                f"{type(effects[0]).__name__}: acts on the arm, and this station has "
                "none; take it out of effects, or use --station cell"
            )

    def _change_environment(self, context: Context, environment: Environment) -> None:
        """Puts what has changed of the world around the bolt into a Context."""
        outside = self.part_context(self.outside_force, context)
        if has_same_material(self.outside_force.material(outside), environment):
            set_pose(self.lock, environment, self.part_context(self.plant, context))
            self.outside_force.set_force(outside, np.array(environment.force_Gn))
        else:
            self._set_environment(context, environment)

    def _set_environment(self, context: Context, environment: Environment) -> None:
        """Puts the world around the bolt into this station's Context."""
        if environment.impact_exponent != self.lock.nominal.impact_exponent:
            raise DisasmError(
                "ContactExponent: hydroelastic contact has none; set contact.model to "
                "impact, on the twin"
            )
        outside = self.part_context(self.outside_force, context)
        self.outside_force.set_force(outside, np.array(environment.force_Gn))
        self.outside_force.set_material(outside, environment)
        set_environment(
            self.lock,
            environment,
            self.part_context(self.plant, context),
            self.scene_graph,
            self.part_context(self.scene_graph, context),
        )

    def at_start(self, effects: Sequence[Effect]) -> Simulator:
        """Returns a simulator of this station alone, commanded to stay at A.

        Its Context is at time zero; `Initialize` it after any further change.
        """
        simulator = Simulator(self)
        context = simulator.get_mutable_context()
        self.set_effects(context, effects)
        self._place_at_start(context)
        self._fix_commands(context)
        return simulator

    def settled(self, effects: Sequence[Effect]) -> Context:
        """Returns a Context of this station alone: bolt gripped at A, at rest."""
        simulator = self.at_start(effects)
        simulator.Initialize()
        simulator.AdvanceTo(self.settling_time)
        return simulator.get_mutable_context()

    @property
    def random_sources(self) -> tuple[RandomSource, ...]:
        """See Station."""
        return (self.sensor_noise,)

    def begin(self, context: Context, effects: Sequence[Effect]) -> InitialState:
        """See Station: the bolt is gripped at A, at rest, and the sensor is zeroed."""
        settled = self.settled(effects)
        self.set_effects(context, effects)
        copy_state(settled, context)
        return InitialState(self.start, self.reading_at_zeroing(settled))

    def bolt_is_out(self, context: Context, lift_needed: float) -> bool:
        """See Station."""
        X_GnB: RigidTransform = self.GetOutputPort("bolt_pose").Eval(context)
        X_GB = self.true_groove_pose(context).inverse() @ X_GnB
        return bool(X_GB.translation()[1] >= lift_needed)

    def reading_at_zeroing(self, context: Context) -> np.ndarray:
        """Returns what the sensor reads, noise averaged away, (6,) [f; tau] in S."""
        return self.sensor.reading_at_zeroing(self.part_context(self.sensor, context))

    def true_groove_pose(self, context: Context) -> RigidTransform:
        """Returns X_GnG, where the groove truly is."""
        return self.lock.frame.GetPoseInParentFrame(
            self.part_context(self.plant, context)
        )

    def part_context(self, part: System, context: Context) -> Context:
        """Returns the Context of a part of this station from the station's own."""
        return self.GetMutableSubsystemContext(part, context)

    def _place_at_start(self, context: Context) -> None:
        """Puts the plant's state where an episode starts, if not at its zeros."""

    def _fix_commands(self, context: Context) -> None:
        """Commands the start, for a station that stands alone."""
        self.GetInputPort(f"{self.arm}.position").FixValue(context, self.start)


class _Clock(LeafSystem):
    """Puts out the time of the newest sample: the plant's newest step.

    @system
    name: Clock
    output_ports:
    - time
    @endsystem
    """

    def __init__(self, time_step: float) -> None:
        super().__init__()
        self._time_step = time_step
        self.DeclareVectorOutputPort(
            "time", 1, self._calc, prerequisites_of_calc={self.time_ticket()}
        )

    def _calc(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector([newest_step(context.get_time(), self._time_step)])


class _BodyPose(LeafSystem):
    """Picks one body's pose, expressed in the groove's nominal frame.

    @system
    name: BodyPose
    input_ports:
    - body_poses
    output_ports:
    - X_GnB
    @endsystem
    """

    def __init__(self, body: int, X_WG: RigidTransform) -> None:
        super().__init__()
        self._body, self._X_GW = body, X_WG.inverse()
        poses = self.DeclareAbstractInputPort(
            "body_poses", Value[list[RigidTransform]]()
        )
        self._poses = poses
        self.DeclareAbstractOutputPort(
            "X_GnB",
            Value[RigidTransform],
            self._calc,
            prerequisites_of_calc={poses.ticket()},
        )

    def _calc(self, context: Context, output: Value) -> None:
        X_WB = self._poses.Eval(context)[self._body]
        output.set_value(self._X_GW @ X_WB)


def copy_state(source: Context, target: Context) -> None:
    """Copies discrete and abstract state between Contexts of one system.

    Drake's own copy (SetTimeStateAndParametersFrom) takes root Contexts only, and
    a station's is a part of the diagram's.
    """
    target.get_mutable_discrete_state().SetFrom(source.get_discrete_state())
    values = target.get_mutable_abstract_state()
    for i in range(source.num_abstract_states()):
        values.get_mutable_value(i).SetFrom(source.get_abstract_state().get_value(i))
