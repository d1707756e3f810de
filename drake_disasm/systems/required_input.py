"""An input without which nothing may be simulated."""

from pydrake.systems.framework import Context, EventStatus, LeafSystem, State

from drake_disasm.common.errors import DisasmError


class RequiredInput(LeafSystem):
    """Refuses, at a simulator's initialisation, that an input is not connected.

    It reads nothing; without it Drake would complain of some port deep inside.

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
