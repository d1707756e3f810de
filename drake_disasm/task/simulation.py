"""One diagram from a scenario, and stepping it by the MDP's period.

The loop::

    policy -> imprecision -> pose target -> motion -> station -> observation
      ^                                                               |
      +---------------------------------------------------------------+
"""

import copy
import dataclasses
import functools
from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np
from pydrake.common import RandomDistribution, RandomGenerator
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import (
    Context,
    Diagram,
    DiagramBuilder,
    LeafSystem,
    OutputPort,
)
from pydrake.systems.primitives import (
    Adder,
    ConstantVectorSource,
    DiscreteTimeIntegrator,
    Gain,
    RandomSource,
)

from drake_disasm.cell.lock import lift_needed
from drake_disasm.common.timing import MOTION_DELAY, POLICY_DELAY, boundary
from drake_disasm.effects import (
    BoltMotion,
    Effect,
    is_local,
    motion_chain,
)
from drake_disasm.mdp import REWARD_TERMS, Outcome, action_bounds
from drake_disasm.scenario import Scenario, draw, with_values
from drake_disasm.stations import Station, make_station
from drake_disasm.systems.imprecision import ImprecisionNoise, clamped
from drake_disasm.systems.observation import ObservationProcessor
from drake_disasm.systems.policy import Policy, PolicySystem
from drake_disasm.systems.pose_target import PoseTarget
from drake_disasm.systems.task_monitor import TaskMonitor

_RANDOM = 2  # sources of randomness: a simulated sensor's noise, and the imprecision


@dataclasses.dataclass(frozen=True)
class StepResult:
    """What one step of the MDP gave.

    Attributes:
        observation: (12,) the state after it.
        reward_terms: the weighted terms by name; the reward is their sum.
        outcome: how the episode stands.
    """

    observation: np.ndarray
    reward_terms: dict[str, float]
    outcome: Outcome

    @property
    def reward(self) -> float:
        """Sum of the terms."""
        return sum(self.reward_terms.values())


class TaskSimulation:
    """The task's diagram, built once and reset in place.

    Without a policy the diagram's `action` input is fed by `step(action)`, as an
    environment for learning does; with one, `step()` lets it act.

    Attributes:
        scenario: as given.
        drawn: what its ranges drew for the running episode, by parameter.
        steps: taken in the running episode.

    Args:
        scenario: what the diagram denotes.
        model: "cell" or "twin".
        policy: observation (12,) to action (6,), or None.
        observers: what watches it (a view); each one's `connect(builder, self)` is
            called before the diagram is built.
        make: makes another station than the simulated one of that model: hardware.
    """

    def __init__(
        self,
        scenario: Scenario,
        model: str,
        policy: Policy | None = None,
        observers: Sequence["Observer"] = (),
        make: Callable[[Scenario], Station] | None = None,
    ) -> None:
        self.scenario, self.model = scenario, model
        self._make = make or functools.partial(make_station, model)
        self.drawn: dict[str, float] = {}
        self._policy, self._observers = policy, tuple(observers)
        self.steps = 0
        self._rate = 0.0
        self._build(scenario)

    def _build(self, scenario: Scenario) -> None:
        """Makes the diagram of a scenario whose ranges are drawn, or left alone."""
        self._built = scenario
        self.bounds = action_bounds(scenario.task)
        builder = DiagramBuilder()
        self.station = builder.AddNamedSystem("station", self._make(scenario))
        self._add_systems(builder, scenario)
        for observer in self._observers:
            observer.connect(builder, self)
        self.diagram: Diagram = builder.Build()
        self.diagram.set_name(f"{scenario.name}_{self.model}")
        self.simulator = Simulator(self.diagram)
        self.simulator.set_target_realtime_rate(self._rate)
        self.context = self.simulator.get_mutable_context()
        self._ports: dict[tuple[int, str], tuple[OutputPort, Context]] = {}
        self._start: Context | None = None
        self._set: list[Effect] = []

    def set_target_realtime_rate(self, rate: float) -> None:
        """Slows the simulation down to `rate` times real time; 0 is full speed."""
        self._rate = rate
        self.simulator.set_target_realtime_rate(rate)

    def reset(self, seed: int, effects: Sequence[Effect] | None = None) -> np.ndarray:
        """Starts an episode in place and returns its first observation (12,).

        Args:
            seed: of sensor noise and imprecision.
            effects: instead of the scenario's; a change settles the station anew.

        What the scenario's ranges draw for this seed is in `drawn`. If it concerns
        effects alone the diagram stays; anything else needs a new one.
        """
        if self.scenario.randomisation:
            self._draw(seed)
        # A copy, so that a later change to the same objects is noticed.
        wanted = copy.deepcopy(
            list(self._built.effects if effects is None else effects)
        )
        if (
            self._start is None
            or wanted != self._set
            or not self.station.start_is_reusable
        ):
            self._start, self._set = self._starting_context(wanted), wanted
        self.context.SetTimeStateAndParametersFrom(self._start)
        sources = self._random_sources
        # From the end, so that the imprecision's is the same where sensors are real.
        seeds = np.random.SeedSequence(seed).generate_state(_RANDOM)[-len(sources) :]
        for source, number in zip(sources, seeds, strict=True):
            source.SetRandomContext(
                source.GetMyMutableContextFromRoot(self.context),
                RandomGenerator(int(number)),
            )
        if self.policy_system and hasattr(self.policy_system.policy, "reset"):
            self.policy_system.policy.reset()
        self.steps = 0
        self.simulator.Initialize()
        self.simulator.AdvanceTo(boundary(0, self.scenario.task.period))
        return self.observation()

    def _draw(self, seed: int) -> None:
        self.drawn = draw(self.scenario, seed)
        wanted = with_values(self.scenario, self.drawn)
        if dataclasses.replace(wanted, effects=[]) != dataclasses.replace(
            self._built, effects=[], randomisation=[]
        ):
            self._build(wanted)
        self._built = wanted

    def step(self, action: np.ndarray | None = None) -> StepResult:
        """Advances one period of the MDP.

        Args:
            action: (6,) for a diagram without a policy; clipped to the bounds.
        """
        if action is not None:
            self._set_action(action)
        self._update_local_effects()
        self.steps += 1
        self.simulator.AdvanceTo(boundary(self.steps, self.scenario.task.period))
        self.station.check()
        terms = self.evaluate(self.monitor, "reward_terms")
        code = self.evaluate(self.monitor, "outcome")
        named = dict(zip(REWARD_TERMS, terms.tolist(), strict=True))
        return StepResult(self.observation(), named, Outcome(int(code[0])))

    def _set_action(self, action: np.ndarray) -> None:
        if self._action_source is None:
            raise ValueError("this diagram's policy chooses the actions")
        context = self._action_source.GetMyMutableContextFromRoot(self.context)
        value = self._action_source.get_mutable_source_value(context)
        value.SetFromVector(clamped(action, self.bounds))

    def _update_local_effects(self) -> None:
        """Brings effects that depend on the bolt's motion up to date for a step."""
        if not is_local(self._set):
            return
        # The policy has acted then, and the motion not yet begun.
        period = self.scenario.task.period
        between = (MOTION_DELAY - POLICY_DELAY) / 2.0
        self.simulator.AdvanceTo(boundary(self.steps, period) + between)
        X_GnB: RigidTransform = self.evaluate(self.station, "bolt_pose")
        action = self.evaluate(self.imprecision, "action_executed")
        motion = BoltMotion(X_GnB.translation(), action[:3] / period)
        context = self.station.GetMyMutableContextFromRoot(self.context)
        self.station.update_local_effects(context, self._set, motion)

    def observation(self) -> np.ndarray:
        """Returns the present state (12,)."""
        return self.evaluate(self.processor, "observation")

    @property
    def time(self) -> float:
        """Time since the episode began [s]."""
        return self.steps * self.scenario.task.period

    def action(self) -> np.ndarray:
        """Returns the action (6,) held now, before imprecision."""
        owner = self.action_port.get_system()
        return self.action_port.Eval(owner.GetMyContextFromRoot(self.context))

    def joint_positions(self) -> np.ndarray:
        """Returns the arm's measured joint angles (7,); the twin has none, (0,)."""
        if self.station.arm != "iiwa":
            return np.zeros(0)
        return self.evaluate(self.station, "iiwa.position_measured")

    def evaluate(self, system: Diagram | LeafSystem, port: str) -> Any:
        """Returns the present value of a system's output port."""
        key = (id(system), port)
        if key not in self._ports:
            context = system.GetMyContextFromRoot(self.context)
            self._ports[key] = (system.GetOutputPort(port), context)
        output, context = self._ports[key]
        return output.Eval(context)

    def bolt_is_out(self) -> bool:
        """Returns whether the bolt truly is out, which only a simulation knows."""
        mine = self.station.GetMyMutableContextFromRoot(self.context)
        return self.station.bolt_is_out(mine, self._lift_needed)

    def _add_systems(self, builder: DiagramBuilder, scenario: Scenario) -> None:
        station, task = self.station, scenario.task
        self._lift_needed = lift_needed(scenario.lock, task.lift_success)
        add = builder.AddNamedSystem
        processor = make_processor(station, scenario.observation.variant)
        self.processor = add("observation_processor", processor)
        self.monitor = add("task_monitor", TaskMonitor(task, self._lift_needed))
        self.imprecision = add(
            "imprecision", ImprecisionNoise(scenario.imprecision, self.bounds)
        )
        noise = add(
            "imprecision_noise",
            RandomSource(RandomDistribution.kGaussian, 6, task.period),
        )
        self.pose_target = add(
            "pose_target",
            PoseTarget(station.coordinates, station.start, task.period),
        )
        self._random_sources = [*station.random_sources, noise]
        connect = builder.Connect
        connect(
            station.GetOutputPort(f"{station.arm}.position_measured"),
            self.processor.GetInputPort("position_measured"),
        )
        connect(
            station.GetOutputPort("ft_sensor.wrench"),
            self.processor.GetInputPort("wrench"),
        )
        connect(self.processor.get_output_port(0), self.monitor.get_input_port())
        connect(noise.get_output_port(), self.imprecision.GetInputPort("noise"))
        connect(
            self.imprecision.get_output_port(),
            self.pose_target.GetInputPort("action"),
        )
        connect(
            self.processor.GetOutputPort("observation"),
            self.pose_target.GetInputPort("observation"),
        )
        velocity = self.pose_target.GetOutputPort("velocity")
        self._integrator = add_motion(builder, velocity, station)
        if station.grip_command is not None:
            grip = add("grip", ConstantVectorSource([station.grip_command]))
            connect(grip.get_output_port(), station.GetInputPort("gripper.position"))
        self._add_policy(builder, self._policy)

    def _add_policy(self, builder: DiagramBuilder, policy: Policy | None) -> None:
        self.policy_system: PolicySystem | None = None
        self._action_source: ConstantVectorSource | None = None
        if policy is None:
            self._action_source = builder.AddNamedSystem(
                "action", ConstantVectorSource(np.zeros(6))
            )
            self.action_port = self._action_source.get_output_port()
        else:
            self.policy_system = builder.AddNamedSystem(
                "policy", PolicySystem(policy, self.scenario.task.period, self.bounds)
            )
            builder.Connect(
                self.processor.get_output_port(0), self.policy_system.get_input_port()
            )
            self.action_port = self.policy_system.get_output_port()
        builder.Connect(self.action_port, self.imprecision.GetInputPort("action"))

    def _starting_context(self, effects: Sequence[Effect]) -> Context:
        """Returns the diagram's Context at t = 0: settled at A and zeroed."""
        root = self.diagram.CreateDefaultContext()
        begun = self.station.begin(
            self.station.GetMyMutableContextFromRoot(root), effects
        )
        target = self.pose_target.GetMyMutableContextFromRoot(root)
        self.pose_target.set_effects(target, motion_chain(effects))
        self.pose_target.set_start(target, begun.position)
        self._integrator.GetMyMutableContextFromRoot(root).SetDiscreteState(
            begun.position
        )
        self.processor.zero(
            self.processor.GetMyMutableContextFromRoot(root),
            begun.reading,
        )
        return root


def make_processor(station: Station, variant: str) -> ObservationProcessor:
    """Returns the observation processing that fits a station, not yet zeroed."""
    return ObservationProcessor(station.coordinates, station.mounting, variant)


def add_motion(
    builder: DiagramBuilder, velocity: OutputPort, station: Station
) -> DiscreteTimeIntegrator:
    """Adds the way from a velocity to the station's position command.

    The command is where the station is to be at the end of its control period:
    the integral so far plus one period's way. Without that lead the motion
    would lag by a period, and so depend on its length.

    Args:
        builder: of the diagram that holds the station.
        velocity: rate of the station's coordinates, a port of size n.
        station: what is moved.

    Returns:
        The integrator; its state is to begin at the station's start.
    """
    connect = builder.Connect
    size, period = len(station.start), station.control_period
    motion = builder.AddNamedSystem("motion", DiscreteTimeIntegrator(size, period))
    lead = builder.AddNamedSystem("lead", Gain(period, size))
    command = builder.AddNamedSystem("position_command", Adder(2, size))
    connect(velocity, motion.get_input_port())
    connect(velocity, lead.get_input_port())
    connect(motion.get_output_port(), command.get_input_port(0))
    connect(lead.get_output_port(), command.get_input_port(1))
    connect(command.get_output_port(), station.GetInputPort(f"{station.arm}.position"))
    if station.has_velocity_input:
        connect(velocity, station.GetInputPort(f"{station.arm}.velocity"))
    return motion


class Observer(Protocol):
    """Something that watches the diagram: adds itself before it is built."""

    def connect(self, builder: DiagramBuilder, simulation: TaskSimulation) -> None:
        """Adds systems to the builder and connects them to the simulation's."""
