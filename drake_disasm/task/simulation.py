"""Stepping a scenario's diagram by the MDP's period, and resetting it in place."""

import copy
import dataclasses
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import (
    Context,
    Diagram,
    DiagramBuilder,
    LeafSystem,
    OutputPort,
    System,
)

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.timing import MOTION_DELAY, POLICY_DELAY, boundary
from drake_disasm.effects import BoltMotion, Effect, is_local
from drake_disasm.mdp import (
    REWARD_TERMS,
    BoltState,
    Outcome,
    action_bounds,
    is_removed,
)
from drake_disasm.scenario import Scenario, draw, with_values
from drake_disasm.scenario.given import scenario_of
from drake_disasm.stations import Station, make_station
from drake_disasm.stations.advance import advance
from drake_disasm.systems.imprecision import clamped
from drake_disasm.systems.policy import Policy
from drake_disasm.task.diagram import TaskSystems, add_task

#: Makes the station of a scenario, in place of one of the stations' names.
StationFactory = Callable[[Scenario], Station]


class Observer(Protocol):
    """Something that watches the task: adds itself before the diagram is built."""

    def connect(self, builder: DiagramBuilder, systems: TaskSystems) -> None:
        """Adds systems to the builder and connects them to the task's."""


@dataclasses.dataclass(frozen=True)
class StepResult:
    """What one step of the MDP returned.

    Attributes:
        observation: (12,) the state after it.
        place: (3,) of the bolt since the start, in G, what it has yielded in the grip
            included [m].
        reward_terms: the weighted terms by name; the reward is their sum.
        outcome: how the episode stands.
        is_whole: whether the station came to the step's end.
    """

    observation: np.ndarray
    place: np.ndarray
    reward_terms: dict[str, float]
    outcome: Outcome
    is_whole: bool = True

    @property
    def reward(self) -> float:
        """Sum of the terms."""
        return sum(self.reward_terms.values())

    def cut_short(self) -> "StepResult":
        """Returns a next step that can't be done: outside of the workspace, as it was.

        Nobody can say what it would have been worth: its reward is 0.
        """
        nothing = dict.fromkeys(self.reward_terms, 0.0)
        return dataclasses.replace(
            self, reward_terms=nothing, outcome=Outcome.WORKSPACE, is_whole=False
        )


class TaskSimulation:
    """The task's diagram, built once, reset in place and stepped by the MDP's period.

    It is a convenience: `make_station` and `add_task` in a diagram of one's own do the
    same. Without a policy, `step(action)` chooses the action, as an environment for
    learning does; with one, `step()` lets the policy act.

    Attributes:
        scenario: that is simulated.
        station: of the running episode's scenario.
        systems: the task's, as `add_task` wired them.
        drawn: values drawn from the scenario's ranges for the running episode, by
            parameter.
        steps: taken in the running episode.

    Args:
        scenario: what is simulated: an object, a shipped name, or a file.
        station: "cell" or "twin", or what makes a station of a scenario (hardware).
        policy: observation (12,) to action (6,), or a System or a class of such (see
            `add_task`), or None.
        observers: each one's `connect` is called before the diagram is built.
    """

    def __init__(
        self,
        scenario: Scenario | str | Path,
        station: str | StationFactory = "cell",
        policy: Policy | System | None = None,
        observers: Sequence[Observer] = (),
    ) -> None:
        self.scenario = scenario_of(scenario)
        self.drawn: dict[str, float] = {}
        self.steps = 0
        self._make, self._policy = station, policy
        self._observers = tuple(observers)
        self._rate = 0.0
        self._build(self.scenario)

    def _build(self, scenario: Scenario) -> None:
        """Makes the diagram of a scenario whose ranges are drawn, or left alone.

        Raises:
            DisasmError: the policy is a System, and part of another diagram already.
        """
        if isinstance(self._policy, System) and hasattr(self, "diagram"):
            raise DisasmError(
                f"policy {type(self._policy).__name__}: a System can't move to another "
                "diagram; randomise effects alone, or give its class or a callable"
            )
        self._built = scenario
        self.bounds = action_bounds(scenario.task)
        builder = DiagramBuilder()
        self.station = builder.AddNamedSystem("station", self._new_station(scenario))
        self.systems = add_task(builder, self.station, self._policy)
        for observer in self._observers:
            observer.connect(builder, self.systems)
        self.diagram: Diagram = builder.Build()
        self.diagram.set_name(scenario.name)
        self.simulator = Simulator(self.diagram)
        self.station.register_caller_updates(self.simulator)  # `step` updates them
        self.simulator.set_target_realtime_rate(self._rate)
        self.context = self.simulator.get_mutable_context()
        self._ports: dict[tuple[int, str], tuple[OutputPort, Context]] = {}
        self._start: Context | None = None
        self._effects: list[Effect] = []

    def _new_station(self, scenario: Scenario) -> Station:
        if isinstance(self._make, str):
            return make_station(self._make, scenario)
        return self._make(scenario)

    def set_target_realtime_rate(self, rate: float) -> None:
        """Slows the simulation down to `rate` times real time; 0 is full speed."""
        self._rate = rate
        self.simulator.set_target_realtime_rate(rate)

    @property
    def station_name(self) -> str:
        """The station's name: "cell", "twin" or "hardware"."""
        return self.station.kind

    def reset(self, seed: int, effects: Sequence[Effect] | None = None) -> np.ndarray:
        """Starts an episode in place and returns its first observation (12,).

        Args:
            seed: of sensor noise and imprecision.
            effects: instead of the scenario's; a change settles the station anew.

        `drawn` holds what this seed draws from the scenario's ranges. If only effects
        depend on it the diagram stays; anything else needs a new one.
        """
        if self.scenario.randomisation:
            self._draw(seed)
        # A copy, so that a later change to the same objects is noticed.
        wanted = copy.deepcopy(
            list(self._built.effects if effects is None else effects)
        )
        if (
            self._start is None
            or wanted != self._effects
            or not self.station.start_is_reusable
        ):
            self._start, self._effects = self._starting_context(wanted), wanted
        self.context.SetTimeStateAndParametersFrom(self._start)
        self.systems.set_seed(self.context, seed)
        self.systems.reset_policy()
        self.steps = 0
        self.simulator.Initialize()
        self.simulator.AdvanceTo(boundary(0, self.scenario.task.period))
        return self.observation()

    def _starting_context(self, effects: Sequence[Effect]) -> Context:
        """Returns the diagram's Context at t = 0: settled at A and zeroed."""
        root = self.diagram.CreateDefaultContext()
        self.systems.begin(root, effects)
        return root

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

        Raises:
            DivergedError: there is no next state; `reset` begins anew.
        """
        if action is not None:
            self._set_action(action)
        self._update_local_effects()
        self.steps += 1
        end = boundary(self.steps, self.scenario.task.period)
        advance(self.simulator, end, self.station_name)
        self.station.check()
        terms = self.evaluate(self.systems.monitor, "reward_terms")
        code = self.evaluate(self.systems.monitor, "outcome")
        named = dict(zip(REWARD_TERMS, terms.tolist(), strict=True))
        found = self.observation()
        place = self.systems.monitor.geometry.place(BoltState.from_vector(found))
        return StepResult(found, place, named, Outcome(int(code[0])))

    def _set_action(self, action: np.ndarray) -> None:
        source = self.systems.action_source
        if source is None:
            raise ValueError("this diagram's policy chooses the actions")
        context = source.GetMyMutableContextFromRoot(self.context)
        value = source.get_mutable_source_value(context)
        value.SetFromVector(clamped(action, self.bounds))

    def _update_local_effects(self) -> None:
        """Brings effects that depend on the bolt's motion up to date for a step."""
        if not is_local(self._effects):
            return
        # The policy has acted then, and the motion not yet begun.
        period = self.scenario.task.period
        between = (MOTION_DELAY - POLICY_DELAY) / 2.0
        self.simulator.AdvanceTo(boundary(self.steps, period) + between)
        X_GnB: RigidTransform = self.evaluate(self.station, "bolt_pose")
        action = self.evaluate(self.systems.imprecision, "action_executed")
        motion = BoltMotion(X_GnB.translation(), action[:3] / period, self.time)
        context = self.station.GetMyMutableContextFromRoot(self.context)
        self.station.update_local_effects(context, self._effects, motion)

    def observation(self) -> np.ndarray:
        """Returns the present state (12,)."""
        return self.evaluate(self.systems.processor, "observation")

    @property
    def time(self) -> float:
        """Time since the episode began [s]."""
        return self.steps * self.scenario.task.period

    def action(self) -> np.ndarray:
        """Returns the action (6,) held now, before imprecision."""
        port = self.systems.action_port
        owner = port.get_system()
        return port.Eval(owner.GetMyContextFromRoot(self.context))

    def joint_positions(self) -> np.ndarray:
        """Returns the arm's measured joint angles (n,); the twin has none, (0,)."""
        if not self.station.joints:
            return np.zeros(0)
        return self.evaluate(self.station, f"{self.station.arm}.position_measured")

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
        if not self.station.HasOutputPort("bolt_pose_in_groove"):
            return False
        X_GB = self.evaluate(self.station, "bolt_pose_in_groove")
        return bool(is_removed(X_GB.translation(), self.systems.monitor.geometry))
