"""The one way of commands to the devices: each in its turn, past the guards."""

from collections.abc import Mapping
from typing import Protocol

import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.framework import (
    Context,
    DiscreteValues,
    EventStatus,
    LeafSystem,
    State,
)

from drake_disasm.cell.coordinates import Coordinates
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.rotations import Pose
from drake_disasm.common.stopwatch import Stopwatch
from drake_disasm.common.timing import GRIPPER_DELAY
from drake_disasm.devices.reading import Clock, Reading
from drake_disasm.safety import LagMonitor, Mode, Pace, Situation, Supervisor
from drake_disasm.safety.pacing import Turn
from drake_disasm.systems.observation import Mounting, contact_wrench

_GRIPPER_PERIOD = 0.05  # s
_STARTED = "the arm's driver does not listen: it has just started"


class Robot(Protocol):
    """The devices that a gate reads, and what drives them.

    Attributes:
        is_commanded: whether anything may be sent to a device that moves.
        clock: by which samples come [s].
        foreign: why somebody else commands the arm; empty if nobody does.
    """

    is_commanded: bool
    clock: Clock

    @property
    def foreign(self) -> str:
        """See above."""

    def let_pass(self, duration: float) -> None:
        """Lets a time [s] pass, and receives what the devices send."""

    def readings(self) -> Mapping[str, Reading]:
        """Returns the newest of each device: "iiwa", "ft_sensor" and others."""

    def listens(self) -> bool:
        """Returns whether the arm's driver takes commands now."""

    def send(self, position: np.ndarray, time: float) -> None:
        """Sends joint positions (n,) [rad] of a time [s] to the arm."""

    def grip(self, opening: float) -> None:
        """Sends an opening [m] to the gripper."""


class CommandGate(LeafSystem):
    """Lets each command have its turn, shows it to the guards, and sends it.

    It waits for real time in an unrestricted update, at each multiple of the period.
    Drake does these before the discrete updates of the same time, in whatever order
    the systems were added: what is read of the devices there is read after the wait.

    The gripper is commanded while the supervisor lets commands through. In a hold it
    keeps its last command: opening would drop the bolt.

    @system
    name: CommandGate
    input_ports:
    - position
    - opening
    output_ports: []
    @endsystem

    Attributes:
        is_open: whether every device has answered; a simulation before is refused.
        supervisor: decides; it outlives the Context, as the robot does.
        pace: keeps commands at their rate, and counts what that costs.
        lag: remembers how far the diagram fell behind, and what its parts took.
        sent: (n,) what was last sent to the arm [rad]; NaN before.

    Args:
        supervisor: see above.
        robot: that is read, and commanded.
        coordinates: maps joint angles to X_GB.
        mounting: geometry and payload of the sensor.
        period: of the position interface [s].
        look: time to pass after a stall [s], in which every device must send.
        lag_window: that the lag is taken over [s].
    """

    def __init__(
        self,
        supervisor: Supervisor,
        robot: Robot,
        coordinates: Coordinates,
        mounting: Mounting,
        period: float,
        look: float,
        lag_window: float,
    ) -> None:
        super().__init__()
        self.is_open, self.supervisor, self.robot = False, supervisor, robot
        self.pace = Pace(period, robot.clock, robot.let_pass, look)
        self.lag = LagMonitor(lag_window)
        self._coordinates, self._mounting = coordinates, mounting
        self._sending = Stopwatch()
        self.add_part("sending", self._sending)
        self._offset: np.ndarray | None = None
        self._before = self.sent = np.full(coordinates.size, np.nan)
        self._wanted = self.DeclareVectorInputPort("position", coordinates.size)
        self._opening = self.DeclareVectorInputPort("opening", 1)
        self.DeclareInitializationDiscreteUpdateEvent(self._refuse_closed)
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, 0.0, self._pass_command)
        self.DeclarePeriodicPublishEvent(_GRIPPER_PERIOD, GRIPPER_DELAY, self._grip)

    def add_part(self, name: str, stopwatch: Stopwatch) -> None:
        """Takes note of a part of the diagram, to be named if it is the slow one."""
        stopwatch.clock = self.robot.clock
        self.lag.stopwatches[name] = stopwatch

    def begin(self, reading: np.ndarray) -> None:
        """Opens at the start of an episode: zeroes the load, forgets the last command.

        Args:
            reading: (6,) of the sensor, taken there.
        """
        self._offset = reading - self._mounting.weight_at_start
        self._before = np.full_like(self._before, np.nan)
        self.pace.begin()
        self.lag.begin()
        self.supervisor.begin()
        self.is_open = True

    def _refuse_closed(self, context: Context, _: DiscreteValues) -> EventStatus:
        if not self.is_open:
            raise DisasmError(
                "the hardware station is not connected to its devices; call "
                "station.begin(context), which waits for them, before the simulation "
                "begins"
            )
        return EventStatus.DidNothing()

    def _pass_command(self, context: Context, _: State) -> EventStatus:
        situation = self._situation(context, self.pace.await_turn())
        position = self.supervisor.command(situation)
        self._before = situation.q_measured
        if self.robot.is_commanded:
            self._send(position, context.get_time(), situation.now)
        return EventStatus.DidNothing()  # to the diagram's state

    def _send(self, position: np.ndarray, time: float, now: float) -> None:
        """Sends a command of a time [s], decided on now [s], if it may leave."""
        if not np.isfinite(position).all():
            raise DisasmError(
                "no position has been measured yet, so no command can be sent; call "
                "station.begin(context) before the simulator's Initialize"
            )
        if self.pace.is_late():
            self.supervisor.withdraw()
            self.pace.skip()
        elif not self.robot.listens():
            self.supervisor.refuse(_STARTED, now)
            self.pace.skip()
        else:
            self.pace.leave(lambda: self._leave(position, time))

    def _leave(self, position: np.ndarray, time: float) -> None:
        with self._sending:
            self.robot.send(position, time)
        self.sent = position

    def _grip(self, context: Context) -> EventStatus:
        if self.robot.is_commanded and self.supervisor.mode is Mode.ACTIVE:
            self.robot.grip(float(self._opening.Eval(context)[0]))
        return EventStatus.Succeeded()

    def _situation(self, context: Context, turn: Turn) -> Situation:
        readings, counts = self.robot.readings(), self.pace.counts
        q = readings["iiwa"].values
        X_GB = self._coordinates.pose(q)
        return Situation(
            turn.now,
            turn.overdue,
            turn.since_sent,
            self._wanted.Eval(context),
            q,
            self._before,
            X_GB,
            self._load(readings["ft_sensor"].values, X_GB),
            readings,
            self.lag.update(turn.now, counts.slipped, counts.waited),
            self.robot.foreign,
        )

    def _load(self, reading: np.ndarray, X_GB: RigidTransform) -> np.ndarray | None:
        """Returns the load (6,) on the bolt at Bo, or None: not zeroed.

        In the axes of S, or of the flange if the sensor is elsewhere.
        """
        if self._offset is None:
            return None
        wrench_G = contact_wrench(reading, self._offset, Pose.of(X_GB), self._mounting)
        R_SG = self._mounting.X_SB.rotation() @ X_GB.rotation().inverse()
        return np.concatenate([R_SG @ wrench_G[:3], R_SG @ wrench_G[3:]])
