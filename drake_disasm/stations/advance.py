"""Advancing a simulation of a station, which may have no next state."""

from pydrake.systems.analysis import Simulator

from drake_disasm.common.errors import DivergedError
from drake_disasm.twin.contact_step import NO_BALANCE

#: By which Drake's messages, and ours, say that there is no next state.
_DIVERGED = ("NaN", "non-finite", "not finite", NO_BALANCE)


def advance(simulator: Simulator, end: float, name: str) -> None:
    """Simulates until a time.

    Args:
        simulator: of a diagram with a station.
        end: the time [s].
        name: of the station, for the message.

    Raises:
        DivergedError: there is no next state, or one of no numbers.
    """
    try:
        simulator.AdvanceTo(end)
    except RuntimeError as error:
        if not any(word in str(error) for word in _DIVERGED):
            raise
        raise DivergedError(
            f"the simulation of the {name} has diverged before {end:.2f} s: its "
            "contact, an effect or the time step can't be right"
        ) from error
