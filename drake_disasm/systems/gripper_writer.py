"""Sends the commanded opening to the gripper's client."""

from collections.abc import Callable

from pydrake.systems.framework import Context, EventStatus, LeafSystem

from drake_disasm.safety import Mode, Supervisor


class GripperWriter(LeafSystem):
    """Commands the opening while the supervisor lets commands through.

    In a hold the gripper keeps its last command: opening would drop the bolt.

    @system
    name: GripperWriter
    input_ports:
    - position
    output_ports: []
    @endsystem

    Args:
        command: takes an opening [m].
        supervisor: of the station.
        period: between commands [s].
    """

    def __init__(
        self,
        command: Callable[[float | None], None],
        supervisor: Supervisor,
        period: float,
    ) -> None:
        super().__init__()
        self._command, self._supervisor = command, supervisor
        self._opening = self.DeclareVectorInputPort("position", 1)
        self.DeclarePeriodicPublishEvent(period, 0.0, self._publish)

    def _publish(self, context: Context) -> EventStatus:
        if self._supervisor.mode is Mode.ACTIVE:
            self._command(float(self._opening.Eval(context)[0]))
        return EventStatus.Succeeded()
