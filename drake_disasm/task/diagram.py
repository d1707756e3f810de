"""The one wiring of the task around a station.

The loop::

    policy -> imprecision -> pose target -> motion -> station -> observation
      ^                                                               |
      +---------------------------------------------------------------+
"""

import dataclasses
import warnings
from collections.abc import Callable, Sequence

import numpy as np
from pydrake.common import RandomDistribution, RandomGenerator
from pydrake.systems.framework import (
    Context,
    DiagramBuilder,
    OutputPort,
    System,
)
from pydrake.systems.primitives import (
    ConstantVectorSource,
    LinearSystem,
    RandomSource,
)

from drake_disasm.common.errors import DisasmWarning
from drake_disasm.effects import Effect, motion_chain
from drake_disasm.mdp import ACTION_NAMES, TaskGeometry, action_bounds
from drake_disasm.scenario import Scenario, TaskConfig
from drake_disasm.stations import InitialState, Station
from drake_disasm.systems.imprecision import ImprecisionNoise
from drake_disasm.systems.observation import ObservationProcessor
from drake_disasm.systems.policy import (
    ActionHold,
    Policy,
    PolicySystem,
    action_port,
)
from drake_disasm.systems.pose_target import PoseTarget
from drake_disasm.systems.task_monitor import TaskMonitor

_LOAD_AT_START = 0.2  # N on the bolt, from which on a start is warned of
_SEEDS = 2  # one for a simulated sensor's noise, one for the imprecision


@dataclasses.dataclass(frozen=True)
class TaskSystems:
    """The systems that `add_task` added, by name.

    Attributes:
        station: around which they are wired.
        processor: sensor readings to the state s; its port `observation` is the MDP's.
        monitor: reward terms and outcome of the newest step.
        imprecision: adds noise to the action, as a less precise robot does.
        imprecision_noise: the source of that noise.
        pose_target: actions to the commanded pose of the bolt, and its coordinates.
        motion: the commanded coordinates to the station's position command.
        policy: the system that chooses actions; None if the caller does.
        action_source: its value is the action, for a caller who chooses it; else None.
        action_port: (6,) the action that is held, before imprecision.
    """

    station: Station
    processor: ObservationProcessor
    monitor: TaskMonitor
    imprecision: ImprecisionNoise
    imprecision_noise: RandomSource
    pose_target: PoseTarget
    motion: LinearSystem
    policy: System | None
    action_source: ConstantVectorSource | None
    action_port: OutputPort

    def begin(
        self, context: Context, effects: Sequence[Effect] | None = None
    ) -> InitialState:
        """Puts the start of the task into a Context whose time is zero.

        The default Context is that start already, unless the effects are not the
        scenario's or the station is a real one.

        Args:
            context: of the whole diagram.
            effects: that act; None for the scenario's own.
        """
        station = self.station
        acting = station.scenario.effects if effects is None else effects
        start = station.begin(station.GetMyMutableContextFromRoot(context), acting)
        target = self.pose_target.GetMyMutableContextFromRoot(context)
        self.pose_target.set_effects(target, motion_chain(acting))
        self.pose_target.set_start(target, start.position)
        motion = self.motion.GetMyMutableContextFromRoot(context)
        motion.SetDiscreteState(start.position)
        processor = self.processor.GetMyMutableContextFromRoot(context)
        self.processor.zero(processor, start.reading)
        self.processor.set_effects(processor, acting)
        warn_of_load(start)
        return start

    def set_seed(self, context: Context, seed: int) -> None:
        """Seeds sensor noise and imprecision in a Context.

        Args:
            context: of the whole diagram; `Initialize` its simulator afterwards.
            seed: the same one gives the same numbers.
        """
        sources = (*self.station.random_sources, self.imprecision_noise)
        # From the end, so that the imprecision's is the same where sensors are real.
        seeds = np.random.SeedSequence(seed).generate_state(_SEEDS)[-len(sources) :]
        for source, number in zip(sources, seeds, strict=True):
            source.SetRandomContext(
                source.GetMyMutableContextFromRoot(context),
                RandomGenerator(int(number)),
            )

    def reset_policy(self) -> None:
        """Tells a policy that is a callable with memory that an episode begins."""
        if isinstance(self.policy, PolicySystem):
            reset: Callable[[], None] | None = getattr(
                self.policy.policy, "reset", None
            )
            if reset:
                reset()


class LoadAtStartWarning(DisasmWarning):
    """An episode begins with a force on the bolt, which zeroing the sensor hides."""


def warn_of_load(start: InitialState) -> None:
    """Warns of a force on the bolt at the start, once for each distinct start."""
    if start.force > _LOAD_AT_START:
        warnings.warn(
            f"the bolt is under {start.force:.2f} N at the start; the sensor is zeroed "
            "there, so that force is missing from every state until the bolt is free; "
            "move the groove back (GroovePose, placement), or take out what pulls",
            LoadAtStartWarning,
            stacklevel=2,
        )


def add_task(
    builder: DiagramBuilder, station: Station, policy: Policy | System | None = None
) -> TaskSystems:
    """Adds the task of a station's scenario to a diagram that holds the station.

    The diagram's default Context is then the start of an episode: a Simulator may
    advance it as it is. `station.attach(simulator)` keeps effects up to date that
    depend on the bolt's motion. See `TaskSystems.begin` for other effects, and for
    hardware, and `TaskSystems.set_seed` for noise.

    Args:
        builder: of the diagram; the station has been added to it.
        station: "cell", "twin" or "hardware", from `make_station`.
        policy: a callable from observation (12,) to action (6,); or a System with the
            input port `observation` (12) and the output port `action` (6), which is
            added here, sampled at the MDP's period and held; or a class of such
            Systems, of which the diagram gets its own; or None: the value of
            `action_source` is the action, zero until it is set.

    Returns:
        Handles of all that was added.

    Raises:
        DisasmError: a system that is no policy.
    """
    processor = add_observation(builder, station, station.scenario.task.period)
    monitor = _add_monitor(builder, station, processor)
    imprecision, noise = _add_imprecision(builder, station.scenario)
    pose_target = _add_pose_target(builder, station, imprecision, processor)
    station.register_motion_effects()  # the pose target applies them
    station.register_part("inverse kinematics", pose_target.stopwatch)
    motion = add_motion(builder, pose_target.GetOutputPort("velocity"), station)
    _add_grip(builder, station)
    chooser, source, action = _add_policy(builder, policy, processor, station)
    builder.Connect(action, imprecision.GetInputPort("action"))
    return TaskSystems(
        station,
        processor,
        monitor,
        imprecision,
        noise,
        pose_target,
        motion,
        chooser,
        source,
        action,
    )


def add_observation(
    builder: DiagramBuilder, station: Station, period: float | None = None
) -> ObservationProcessor:
    """Adds the processing of a station's readings to the task's state s.

    Args:
        builder: of the diagram that holds the station.
        station: whose readings are processed; zeroed where its episode starts.
        period: of the MDP [s]; None: effects on the measured pose don't act.
    """
    processor = builder.AddNamedSystem(
        "observation_processor",
        ObservationProcessor(
            station.coordinates,
            station.mounting,
            station.scenario.observation.variant,
            station.initial_state.reading if station.start_is_reusable else None,
            period,
            station.scenario.effects,
        ),
    )
    for port, name in (
        (f"{station.arm}.position_measured", "position_measured"),
        ("ft_sensor.wrench", "wrench"),
    ):
        builder.Connect(station.GetOutputPort(port), processor.GetInputPort(name))
    return processor


def add_motion(
    builder: DiagramBuilder, velocity: OutputPort, station: Station
) -> LinearSystem:
    """Adds the integration of a velocity into the station's position command.

    The command is where the station is to be at the end of its control period h:
    x + h u, with x the integral so far. Without that lead the motion would lag by
    a period, and so depend on its length.

    Args:
        builder: of the diagram that holds the station.
        velocity: rate u of the station's coordinates, a port of size n.
        station: what is moved.

    Returns:
        The integrator; its default state x is the station's start.
    """
    I = np.eye(len(station.start))  # noqa: E741
    h = station.control_period
    motion = builder.AddNamedSystem("motion", LinearSystem(I, h * I, I, h * I, h))
    motion.configure_default_state(station.start)
    builder.Connect(velocity, motion.get_input_port())
    builder.Connect(
        motion.get_output_port(), station.GetInputPort(f"{station.arm}.position")
    )
    if station.has_velocity_input:
        builder.Connect(velocity, station.GetInputPort(f"{station.arm}.velocity"))
    return motion


def _add_monitor(
    builder: DiagramBuilder, station: Station, processor: ObservationProcessor
) -> TaskMonitor:
    scenario = station.scenario
    monitor = builder.AddNamedSystem(
        "task_monitor", TaskMonitor(scenario.task, TaskGeometry.of(scenario))
    )
    observation = processor.GetOutputPort("observation")
    builder.Connect(observation, monitor.GetInputPort("observation"))
    is_known = station.HasOutputPort("bolt_pose_in_groove")
    if is_known and scenario.task.judged_by == "bolt":
        truth = station.GetOutputPort("bolt_pose_in_groove")
        builder.Connect(truth, monitor.GetInputPort("X_GB"))
    return monitor


def _add_imprecision(
    builder: DiagramBuilder, scenario: Scenario
) -> tuple[ImprecisionNoise, RandomSource]:
    """Returns what makes the action imprecise, and the source of its noise."""
    bounds, size = action_bounds(scenario.task), len(ACTION_NAMES)
    imprecision = builder.AddNamedSystem(
        "imprecision", ImprecisionNoise(scenario.imprecision, bounds)
    )
    noise = builder.AddNamedSystem(
        "imprecision_noise",
        RandomSource(RandomDistribution.kGaussian, size, scenario.task.period),
    )
    builder.Connect(noise.get_output_port(), imprecision.GetInputPort("noise"))
    return imprecision, noise


def _add_pose_target(
    builder: DiagramBuilder,
    station: Station,
    imprecision: ImprecisionNoise,
    processor: ObservationProcessor,
) -> PoseTarget:
    target = builder.AddNamedSystem(
        "pose_target",
        PoseTarget(
            station.coordinates,
            station.start,
            station.scenario.task.period,
            motion_chain(station.scenario.effects),
        ),
    )
    builder.Connect(imprecision.get_output_port(), target.GetInputPort("action"))
    observation = processor.GetOutputPort("observation")
    builder.Connect(observation, target.GetInputPort("observation"))
    return target


def _add_grip(builder: DiagramBuilder, station: Station) -> None:
    """Commands the grip, if the station has a gripper."""
    if station.grip_command is not None:
        grip = builder.AddNamedSystem(
            "grip", ConstantVectorSource([station.grip_command])
        )
        builder.Connect(
            grip.get_output_port(), station.GetInputPort("gripper.position")
        )


def _add_policy(
    builder: DiagramBuilder,
    policy: Policy | System | None,
    processor: ObservationProcessor,
    station: Station,
) -> tuple[System | None, ConstantVectorSource | None, OutputPort]:
    """Returns what chooses the actions, what holds the caller's, and their port."""
    task = station.scenario.task
    if policy is None:
        source = builder.AddNamedSystem(
            "action", ConstantVectorSource(np.zeros(len(ACTION_NAMES)))
        )
        return None, source, source.get_output_port()
    observation = processor.GetOutputPort("observation")
    if isinstance(policy, type) and issubclass(policy, System):
        policy = policy()
    if isinstance(policy, System):
        hold = _add_policy_system(builder, policy, observation, task)
        station.register_part("policy", hold.stopwatch)
        return policy, None, hold.get_output_port()
    system = builder.AddNamedSystem(
        "policy", PolicySystem(policy, task.period, action_bounds(task))
    )
    station.register_part("policy", system.stopwatch)
    builder.Connect(observation, system.get_input_port())
    return system, None, system.get_output_port()


def _add_policy_system(
    builder: DiagramBuilder, policy: System, observation: OutputPort, task: TaskConfig
) -> ActionHold:
    """Returns what holds a policy system's action for a period at a time."""
    chosen = action_port(policy)
    if policy not in builder.GetSystems():
        builder.AddNamedSystem("policy", policy)
    hold = builder.AddNamedSystem(
        "action_hold", ActionHold(task.period, action_bounds(task))
    )
    builder.Connect(observation, policy.GetInputPort("observation"))
    builder.Connect(chosen, hold.get_input_port())
    return hold
