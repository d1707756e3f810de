"""A check that an input is connected."""

from pydrake.systems.framework import Context, EventStatus, LeafSystem, State

from drake_disasm.common.errors import DisasmError


class RequiredInput(LeafSystem):
    """Raises at a simulator's initialisation if its input is not connected.

    It computes nothing; Drake's own message would name a port inside the station.

    @system
    name: RequiredInput
    input_ports:
    - value
    output_ports: []
    @endsystem

    Args:
        name: of the station's port.
        size: of the port.
        remedy: what to do, for the message.
    """

    def __init__(self, name: str, size: int, remedy: str) -> None:
        super().__init__()
        self._name, self._remedy = name, remedy
        self._value = self.DeclareVectorInputPort("value", size)
        self.DeclareInitializationUnrestrictedUpdateEvent(self._check)

    def _check(self, context: Context, state: State) -> EventStatus:
        if not self._value.HasValue(context):
            raise DisasmError(
                f"the station's {self._name} is not connected; {self._remedy}"
            )
        return EventStatus.DidNothing()
