"""The effects that a station simulates, and a check that each of them can act."""

import contextlib
import weakref
from collections.abc import Iterator, Sequence

from pydrake.common.value import Value
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context, EventStatus, LeafSystem, State

from drake_disasm.common.errors import DisasmError
from drake_disasm.effects import Effect, PoseEffect, is_local, motion_chain


class EffectsInForce(LeafSystem):
    """Holds the effects of a station's Context; refuses those that would not act.

    Effects that depend on the bolt's motion must be updated from outside the diagram
    (see LocalEffectsMonitor), and motion effects act before the station. If either is
    missing, the simulator's initialisation fails: no effect is silently ignored.

    @system
    name: EffectsInForce
    input_ports: []
    output_ports: []
    @endsystem

    Attributes:
        motion_is_applied: whether the diagram around the station applies the effects
            on the motion.

    Args:
        effects: in force in the default Context.
    """

    def __init__(self, effects: Sequence[Effect]) -> None:
        super().__init__()
        self.motion_is_applied = False
        self._updated: weakref.WeakSet[Simulator] = weakref.WeakSet()
        self._is_at_rest = False
        self._effects = self.DeclareAbstractParameter(Value[object](tuple(effects)))
        self.DeclareInitializationUnrestrictedUpdateEvent(self._check)

    def set(self, context: Context, effects: Sequence[Effect]) -> None:
        """Sets the effects that are in force in this system's Context."""
        parameter = context.get_mutable_abstract_parameter(self._effects)
        parameter.set_value(tuple(effects))

    def get(self, context: Context) -> tuple[Effect, ...]:
        """Returns the effects that are in force in this system's Context."""
        return context.get_abstract_parameter(self._effects).get_value()

    def note_updated(self, simulator: Simulator) -> None:
        """Registers a simulator whose motion-dependent effects are updated."""
        self._updated.add(simulator)

    @contextlib.contextmanager
    def at_rest(self) -> Iterator[None]:
        """Lets simulations of the bolt at rest at A begin, which need no updates.

        Whatever diagram the station has joined meanwhile: such a simulation is of the
        station alone, whose Context a larger diagram does not know.
        """
        self._is_at_rest = True
        try:
            yield
        finally:
            self._is_at_rest = False

    def _check(self, context: Context, state: State) -> EventStatus:
        if not self._is_at_rest:
            updated = self._is_of(context, self._updated)
            for effect in self.get(context):
                self._refuse(effect, updated)
        return EventStatus.DidNothing()

    def _refuse(self, effect: Effect, updated: bool) -> None:
        name = type(effect).__name__
        if is_local([effect]) and not updated:
            raise DisasmError(
                f"{name}: depends on the bolt's motion and would not act here; add the "
                "line station.attach(simulator) before the simulation begins"
            )
        on_pose = isinstance(effect, PoseEffect) and not effect.is_null
        if (on_pose or motion_chain([effect])) and not self.motion_is_applied:
            raise DisasmError(
                f"{name}: acts outside the station, on the pose that is commanded or "
                "measured, and would not act here; build the diagram with "
                "add_task(builder, station)"
            )

    def _is_of(
        self, context: Context, simulators: "weakref.WeakSet[Simulator]"
    ) -> bool:
        """Returns whether a Context of this system belongs to one of the simulators."""
        return any(self._context_in(s) is context for s in list(simulators))

    def _context_in(self, simulator: Simulator) -> Context | None:
        try:
            return self.GetMyContextFromRoot(simulator.get_context())
        except RuntimeError:  # a simulator of the station before it joined a diagram
            return None
