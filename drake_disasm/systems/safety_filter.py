"""The supervisor as a system between the policy's command and the arm."""

from collections.abc import Callable, Mapping

import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiscreteValues,
    EventStatus,
    LeafSystem,
)

from drake_disasm.cell.coordinates import Coordinates
from drake_disasm.common.errors import DisasmError
from drake_disasm.safety import CommandPacer, LagMonitor, Situation, Supervisor
from drake_disasm.systems.device_reader import Readable
from drake_disasm.systems.observation import Mounting, contact_wrench


class SafetyFilter(LeafSystem):
    """Sends to the arm what its supervisor lets through, once a control period.

    @system
    name: SafetyFilter
    input_ports:
    - position
    output_ports:
    - position_sent
    @endsystem

    Args:
        supervisor: decides; it outlives the Context, as the robot does.
        pacer: lets each command wait for its turn, by the devices' clock.
        lag: remembers how far the diagram fell behind.
        devices: by name; "iiwa" tells where the arm is, "ft_sensor" the load.
        coordinates: maps joint angles to X_GB.
        mounting: geometry and payload of the sensor.
        period: of the position interface [s].
        foreign: returns why somebody else commands the arm; empty if nobody does.
    """

    def __init__(
        self,
        supervisor: Supervisor,
        pacer: CommandPacer,
        lag: LagMonitor,
        devices: Mapping[str, Readable],
        coordinates: Coordinates,
        mounting: Mounting,
        period: float,
        foreign: Callable[[], str] = lambda: "",
    ) -> None:
        super().__init__()
        self._supervisor, self._pacer, self._lag = supervisor, pacer, lag
        self._foreign = foreign
        self._devices, self._coordinates, self._mounting = (
            devices,
            coordinates,
            mounting,
        )
        self._offset: np.ndarray | None = None
        self._before = np.full(coordinates.size, np.nan)
        self._wanted = self.DeclareVectorInputPort("position", coordinates.size)
        self._sent = self.DeclareDiscreteState(np.full(coordinates.size, np.nan))
        self.DeclareInitializationDiscreteUpdateEvent(self._update)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)
        self.DeclareVectorOutputPort(
            "position_sent",
            coordinates.size,
            self._calc,
            prerequisites_of_calc={self.xd_ticket()},
        )

    def zero(self, reading: np.ndarray) -> None:
        """Zeroes the load: `reading` (6,) was taken at the start of an episode."""
        weight = self._mounting.weight(self._mounting.X_BS.rotation())
        self._offset = reading - weight

    def begin(self) -> None:
        """Forgets the last command: there are none between episodes."""
        self._before = np.full_like(self._before, np.nan)
        self._pacer.begin()
        self._lag.begin()

    def _update(self, context: Context, state: DiscreteValues) -> EventStatus:
        situation = self._situation(context)
        state.set_value(self._sent, self._supervisor.command(situation))
        self._before = situation.q_measured
        return EventStatus.Succeeded()

    def _calc(self, context: Context, output: BasicVector) -> None:
        sent = context.get_discrete_state(self._sent).value()
        if not np.isfinite(sent).all():
            raise DisasmError(
                "no position has been measured yet, so no command can be sent; call "
                "station.begin(context) before the simulator's Initialize"
            )
        output.SetFromVector(sent)

    def _situation(self, context: Context) -> Situation:
        now, pacer = self._pacer.await_turn(), self._pacer
        readings = {name: device.read() for name, device in self._devices.items()}
        q = readings["iiwa"].values
        X_GB = self._coordinates.pose(q)
        return Situation(
            now,
            pacer.overdue,
            pacer.since_sent(now),
            self._wanted.Eval(context),
            q,
            self._before,
            X_GB,
            self._load(readings["ft_sensor"].values, X_GB),
            readings,
            self._lag.update(now, pacer.counts.slipped, pacer.counts.waited),
            self._foreign(),
        )

    def _load(self, reading: np.ndarray, X_GB: RigidTransform) -> np.ndarray | None:
        """Returns the load (6,) on the bolt at Bo in S's axes, or None: not zeroed."""
        if self._offset is None:
            return None
        wrench_G = contact_wrench(
            reading, self._offset, X_GB.rotation(), self._mounting
        )
        R_SG = self._mounting.X_SB.rotation() @ X_GB.rotation().inverse()
        return np.concatenate([R_SG @ wrench_G[:3], R_SG @ wrench_G[3:]])
