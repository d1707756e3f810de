"""Sends joint positions to the arm, each in its turn."""

from collections.abc import Callable

import numpy as np
from pydrake.systems.framework import Context, EventStatus, LeafSystem

from drake_disasm.common.stopwatch import Stopwatch
from drake_disasm.common.timing import COMMAND_DELAY
from drake_disasm.safety import CommandPacer, Supervisor

_STARTED = "the arm's driver does not listen: it has just started"


class ArmCommandWriter(LeafSystem):
    """Sends what the safety filter let through, once a control period.

    Drake's own publisher sends whenever the simulator gets there, and does not say
    when it has. Here a command that was decided before a stall is not sent after it,
    and the next one's turn is counted from when this one has left.

    @system
    name: ArmCommandWriter
    input_ports:
    - position
    output_ports: []
    @endsystem

    Attributes:
        send: as given; may be replaced.
        stopwatch: what sending takes.

    Args:
        send: takes joint positions (7,) [rad] and the time [s].
        listens: whether the arm's driver takes commands now.
        pacer: of the station.
        supervisor: of the station.
        period: of the commands [s].
        size: number of joints.
    """

    def __init__(
        self,
        send: Callable[[np.ndarray, float], None],
        listens: Callable[[], bool],
        pacer: CommandPacer,
        supervisor: Supervisor,
        period: float,
        size: int,
    ) -> None:
        super().__init__()
        self.send, self._listens = send, listens
        self._pacer, self._supervisor = pacer, supervisor
        self.stopwatch = Stopwatch()
        self._position = self.DeclareVectorInputPort("position", size)
        self.DeclarePeriodicPublishEvent(period, COMMAND_DELAY, self._publish)

    def _publish(self, context: Context) -> EventStatus:
        position = self._position.Eval(context)
        if self._pacer.refuse_late():
            self._supervisor.withdraw()
            return EventStatus.Succeeded()
        if not self._listens():
            self._supervisor.refuse(_STARTED, self._pacer.turn)
            self._pacer.skipped()
            return EventStatus.Succeeded()
        self._pacer.await_gap()
        with self.stopwatch:
            self.send(position, context.get_time())
        self._pacer.sent()
        return EventStatus.Succeeded()
