"""The twin driven open loop: from a measured state, through a measured command.

What the encoders don't see, by how much the grip gives and how fast, is known from the
measured wrench: a step begins where pose and wrench agree with what was measured.
"""

import dataclasses

import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from drake_disasm.common.spatial import (
    pose_from_vector,
    rotation_vector,
)
from drake_disasm.common.timing import boundary
from drake_disasm.effects import BoltMotion
from drake_disasm.scenario import Scenario
from drake_disasm.stations import TwinStation
from drake_disasm.task.diagram import add_motion, add_observation
from drake_disasm.twin.steps import Ends, Steps, bolt_motion, noise_free


@dataclasses.dataclass(frozen=True)
class TwinState:
    """State of a moving twin, in its coordinates; each (6,).

    Attributes:
        q, v: coordinates of the arm, which are measured, and their rates.
        qd: commanded coordinates.
        q_bolt, v_bolt: coordinates of the bolt and their rates.
    """

    q: np.ndarray
    v: np.ndarray
    qd: np.ndarray
    q_bolt: np.ndarray
    v_bolt: np.ndarray


class TwinReplay:
    """Simulates measured steps of the task, each from a given state.

    It is the task's diagram without policy, reward and imprecision, and with a sensor
    without noise. Of the scenario's effects, those on the environment act, and those
    on the sensor that have no memory; effects on the motion must be in the steps'
    commands already. The motion is integrated by Drake; Python is called once a step,
    at its end. `reconfigure` changes the parameters in place, so
    that one diagram serves a whole identification.

    The coordinates are the twin's: x, y, z [m], turns about z, x, y [rad] of B in Gn
    (`BoltCoordinates`).

    Args:
        scenario: what the twin is.
    """

    def __init__(self, scenario: Scenario) -> None:
        self._build(scenario)

    def _build(self, scenario: Scenario) -> None:
        self._diagram = ReplayDiagram(scenario)
        self._diagram.zero()
        self._period = scenario.task.period

    def reconfigure(self, scenario: Scenario) -> None:
        """Takes a scenario's parameters, in place where the station can.

        Raises:
            DisasmError: the scenario is out of bounds.
        """
        if not self._diagram.can_reconfigure(scenario):
            self._build(scenario)
            return
        self._diagram.reconfigure(scenario)
        self._diagram.zero()

    @property
    def reading_at_zeroing(self) -> np.ndarray:
        """What the sensor read (6,) when it was zeroed, [f; tau] in S."""
        return self._diagram.reading_at_zeroing

    def transitions(self, steps: Steps) -> np.ndarray:
        """Returns the states (n, 12) after independent steps, each from its own start.

        Raises:
            RuntimeError: Drake's contact solver did not converge.
        """
        return self.ends(steps).states

    def ends(self, steps: Steps) -> Ends:
        """Returns where n independent steps lead, each from its own start.

        Raises:
            RuntimeError: Drake's contact solver did not converge.
        """
        states, give = np.zeros((len(steps), 12)), np.zeros((len(steps), 6))
        for i in range(len(steps)):
            self._start(steps, i)
            states[i] = self.advance(steps.qd_rate[i])
            reached = self._diagram.state()
            give[i] = reached.q_bolt - reached.q
        return Ends(states, give)

    def episode(self, steps: Steps) -> np.ndarray:
        """Returns the states (n, 12) after consecutive steps from the first state.

        Raises:
            RuntimeError: Drake's contact solver did not converge.
        """
        self._start(steps, 0)
        return np.array([self.advance(rate) for rate in steps.qd_rate])

    def _start(self, steps: Steps, i: int) -> None:
        self.start(
            int(steps.index[i]),
            steps.q[i],
            steps.v[i],
            steps.qd[i],
            steps.wrench[i],
            steps.give_rate[i],
        )

    def start(
        self,
        step: int,
        q: np.ndarray,
        v: np.ndarray,
        qd: np.ndarray,
        wrench: np.ndarray,
        give_rate: np.ndarray | None = None,
    ) -> None:
        """Sets the twin's state by what was measured.

        Args:
            step: periods of the MDP since the episode began.
            q, v: (6,) measured coordinates and their rates.
            qd: (6,) commanded coordinates.
            wrench: (6,) that the grip's springs carry, on the bolt at Bo in Gn.
            give_rate: (6,) rates of the bolt against the arm; None: it moves along.
        """
        self._step = step
        q_bolt = q + self._diagram.station.deflection(wrench)
        v_bolt = v if give_rate is None else v + give_rate
        self._state: TwinState | None = TwinState(q, v, qd, q_bolt, v_bolt)

    def advance(self, qd_rate: np.ndarray) -> np.ndarray:
        """Moves the command at a rate for one period; returns the state (12,) then.

        Args:
            qd_rate: (6,) rate of the commanded coordinates.

        Raises:
            RuntimeError: Drake's contact solver did not converge.
        """
        begin, end = (boundary(self._step + i, self._period) for i in (0, 1))
        time = self._step * self._period
        self._step += 1
        state = self._state or self._diagram.state()
        motion = self._diagram.motion(state.q_bolt, qd_rate, time)
        self._diagram.update_local_effects(motion)
        if self._state:
            self._diagram.start(begin, state)
        self._state = None
        self._diagram.advance(qd_rate, end)
        return self._diagram.observation()


class ReplayDiagram:
    """The twin with a command that moves at a constant rate, and its observation.

    Attributes:
        station, station_context: the twin.
        processor, processor_context: of its observations.
        effects: that are set.
        reading_at_zeroing: (6,) what the sensor read then, [f; tau] in S.
    """

    def __init__(self, scenario: Scenario) -> None:
        self._build(noise_free(scenario))

    def can_reconfigure(self, scenario: Scenario) -> bool:
        """Returns whether `reconfigure` can take a scenario's parameters."""
        return self.station.can_reconfigure(noise_free(scenario))

    def reconfigure(self, scenario: Scenario) -> None:
        """Takes a scenario's parameters in place, from a clean Context."""
        self._simulator.reset_context(self._clean.Clone())
        self._find_contexts()
        self.effects = scenario.effects
        self.station.reconfigure(self.station_context, noise_free(scenario))

    def zero(self) -> None:
        """Lets the bolt settle at A and zeroes the sensor, as at an episode's start."""
        rest = np.zeros(6)
        at_start = TwinState(rest, rest, self.station.start, rest, rest)
        self.start(boundary(0, 1.0), at_start)
        self.advance(rest, self.station.settling_time)
        reading = self.station.reading_at_zeroing(self.station_context)
        self.reading_at_zeroing = reading
        self.processor.zero(self.processor_context, reading)

    def motion(
        self, q_bolt: np.ndarray, qd_rate: np.ndarray, time: float
    ) -> BoltMotion:
        """Returns the bolt's motion in a step, for local effects.

        Args:
            q_bolt: (6,) coordinates of the bolt.
            qd_rate: (6,) rate of the commanded coordinates.
            time: of the step's beginning [s].
        """
        station = self.station
        p_BoTo_B = station.parameters.p_BoTo_B
        return bolt_motion(station.coordinates, p_BoTo_B, q_bolt, qd_rate, time)

    def update_local_effects(self, motion: BoltMotion) -> None:
        """Brings effects that depend on the bolt's motion up to date."""
        self.station.update_local_effects(self.station_context, self.effects, motion)

    def start(self, time: float, state: TwinState) -> None:
        """Sets the twin's state and the time [s]."""
        self._context.SetTime(time)
        plant = self.station.plant
        plant.SetPositions(self._plant_context, state.q_bolt)
        plant.SetVelocities(self._plant_context, state.v_bolt)
        self._arm_context.SetDiscreteState(np.concatenate([state.q, state.v]))
        self._motion_context.SetDiscreteState(state.qd)
        self._simulator.Initialize()

    def advance(self, qd_rate: np.ndarray, time: float) -> None:
        """Moves the command at a rate (6,) until a time [s]."""
        self._rate.SetFromVector(qd_rate)
        self._simulator.AdvanceTo(time)

    def state(self) -> TwinState:
        """Returns the present state."""
        plant = self.station.plant
        arm = self._arm_context.get_discrete_state_vector().CopyToVector()
        return TwinState(
            q=arm[:6],
            v=arm[6:],
            qd=self._motion_context.get_discrete_state_vector().CopyToVector(),
            q_bolt=plant.GetPositions(self._plant_context),
            v_bolt=plant.GetVelocities(self._plant_context),
        )

    def observation(self) -> np.ndarray:
        """Returns the state (12,) of the task now, its rotation as a vector."""
        observation = self._observation.Eval(self.processor_context)
        X_GB = pose_from_vector(self._pose.Eval(self.processor_context))
        return _with_rotation_vector(observation, X_GB)

    def _build(self, scenario: Scenario) -> None:
        builder = DiagramBuilder()
        self.station = builder.AddNamedSystem("station", TwinStation(scenario))
        self._source = builder.AddNamedSystem("rate", ConstantVectorSource(np.zeros(6)))
        self._motion = add_motion(builder, self._source.get_output_port(), self.station)
        self.processor = add_observation(builder, self.station)
        self._simulator = Simulator(builder.Build())
        self.station.register_caller_updates(self._simulator)
        self.station.register_motion_effects()  # the steps' commands have them
        self._clean: Context = self._simulator.get_context().Clone()
        self._observation = self.processor.GetOutputPort("observation")
        self._pose = self.processor.GetOutputPort("X_GB")
        self._find_contexts()
        self.effects = scenario.effects

    def _find_contexts(self) -> None:
        root = self._simulator.get_mutable_context()
        self._context = root
        self.station_context = self.station.GetMyMutableContextFromRoot(root)
        self._plant_context = self.station.plant.GetMyMutableContextFromRoot(root)
        arm = self.station.arm_node.system
        self._arm_context = arm.GetMyMutableContextFromRoot(root)
        self._motion_context = self._motion.GetMyMutableContextFromRoot(root)
        self.processor_context = self.processor.GetMyMutableContextFromRoot(root)
        source_context = self._source.GetMyMutableContextFromRoot(root)
        self._rate = self._source.get_mutable_source_value(source_context)


def _with_rotation_vector(observation: np.ndarray, X_GB: RigidTransform) -> np.ndarray:
    """Returns a state (12,) whose rotation is a vector, whatever the variant."""
    turn = rotation_vector(X_GB.rotation())
    return np.concatenate([observation[:3], turn, observation[6:]])
