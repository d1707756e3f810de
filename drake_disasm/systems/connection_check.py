"""A check that the real devices are connected before a simulation starts."""

from pydrake.systems.framework import Context, EventStatus, LeafSystem, State

from drake_disasm.common.errors import DisasmError


class ConnectionCheck(LeafSystem):
    """Refuses, at a simulator's initialisation, devices that are not connected.

    @system
    name: ConnectionCheck
    input_ports: []
    output_ports: []
    @endsystem

    Attributes:
        is_connected: whether every device has answered.
    """

    def __init__(self) -> None:
        super().__init__()
        self.is_connected = False
        self.DeclareInitializationUnrestrictedUpdateEvent(self._check)

    def _check(self, context: Context, state: State) -> EventStatus:
        if not self.is_connected:
            raise DisasmError(
                "the hardware station is not connected to its devices; call "
                "station.begin(context), which waits for them, before the simulation "
                "begins"
            )
        return EventStatus.DidNothing()
