"""The force/torque sensor, as the simulated stations carry it."""

from collections.abc import Sequence

import numpy as np
from pydrake.common.value import Value
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DependencyTicket,
    DiscreteValues,
    EventStatus,
    LeafSystem,
)

from drake_disasm.common.arrays import Array, namespace
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.ports import Health
from drake_disasm.common.timing import newest_step
from drake_disasm.devices.load_source import LoadSource
from drake_disasm.devices.sensor_chain import (
    Payload,
    memory_size,
    sensed_at_zeroing,
    sensed_sample,
)
from drake_disasm.effects import Sensing, SensorEffect
from drake_disasm.scenario import SensorConfig

#: How many numbers the effects of a sensor may remember together.
MOST_REMEMBERED = 512


class ForceTorqueSensor(LeafSystem):
    """Turns a load into what an OnRobot HEX-E would report.

    The reading is the load on the sensor at So in S, [f; tau], untared: a mass
    that hangs on it reads downwards. It is the source's load through the effects,
    plus noise, in whole counts. While there has been no step yet, `health` is NO_DATA
    and the load is that at rest, if `set_load_at_rest` has told it.

    @system
    name: ForceTorqueSensor
    input_ports:
    - noise
    - those of `source`
    output_ports:
    - wrench
    - health
    - time_measured
    @endsystem

    Args:
        config: noise and quantum per channel.
        source: of the load.
        payload: that hangs on the sensor.
        time_step: of the plant whose load is read [s].
        effects: of the default Context, in the order of the chain.
    """

    def __init__(
        self,
        config: SensorConfig,
        source: LoadSource,
        payload: Payload,
        time_step: float,
        effects: Sequence[SensorEffect] = (),
    ) -> None:
        super().__init__()
        _refuse_too_many_memories(effects)
        self._noise, self._quantum = np.array(config.noise), np.array(config.quantum)
        self._source, self._payload = source, payload
        self._time_step = time_step
        self._effects = self.DeclareAbstractParameter(Value[object](tuple(effects)))
        self._load_at_rest: np.ndarray | None = None
        of_load = source.declare(self)
        self._noise_port = self.DeclareVectorInputPort("noise", 6)
        self._memory = self.DeclareDiscreteState(MOST_REMEMBERED)
        self._remembered = self.DeclareDiscreteState([np.nan])  # when [s]
        self.DeclarePeriodicDiscreteUpdateEvent(config.period, 0.0, self._update)
        self._declare_outputs(of_load)

    def _declare_outputs(self, of_load: set[DependencyTicket]) -> None:
        # Not the time: between two plant steps the sensor has no new sample, and
        # what depends on time takes that of the newest step.
        tickets = of_load | {
            self._noise_port.ticket(),
            self.xd_ticket(),
            self.all_parameters_ticket(),
        }
        self.DeclareVectorOutputPort(
            "wrench", 6, self._calc_wrench, prerequisites_of_calc=tickets
        )
        self.DeclareVectorOutputPort(
            "health", 1, self._calc_health, prerequisites_of_calc=of_load
        )
        self.DeclareVectorOutputPort("time_measured", 1, self._calc_time)

    def set_effects(self, context: Context, effects: Sequence[SensorEffect]) -> None:
        """Puts the effects, in their order, into this system's Context.

        Raises:
            DisasmError: more of them have a memory than the sensor has room for.
        """
        _refuse_too_many_memories(effects)
        parameter = context.get_mutable_abstract_parameter(self._effects)
        parameter.set_value(tuple(effects))

    def set_load_at_rest(self, load: np.ndarray) -> None:
        """Takes what hangs on the sensor (6,) before the first step, for all Contexts.

        A sensor has been there for long when a simulation begins: effects with a
        memory begin at this load, not at the zeros of a plant that has not stepped.
        """
        self._load_at_rest = np.array(load)

    def forget(self, context: Context) -> None:
        """Lets effects with a memory begin anew, at the load of the first sample."""
        context.get_mutable_discrete_state(self._remembered).SetAtIndex(0, np.nan)

    def load(self, context: Context) -> np.ndarray:
        """Returns the load on the sensor (6,), [f; tau] at So in S."""
        load = self._source.load(context)
        if load.any() or self._load_at_rest is None:
            return load
        return self._load_at_rest

    def reading_at_zeroing(self, context: Context) -> np.ndarray:
        """Returns the noise-free mean (6,) of readings that zeroing averages.

        Whenever it is taken, zeroing is time 0 for the effects: the episode begins.
        """
        effects, sensing = self.effects(context), self._sensing(context, 0.0)
        return sensed_at_zeroing(self.load(context), effects, sensing)

    def effects(self, context: Context) -> Sequence[SensorEffect]:
        """Returns what `set_effects` put there."""
        return context.get_abstract_parameter(self._effects).get_value()

    def _sensing(self, context: Context, time: float) -> Sensing:
        R_WS = self._source.R_WS(context)
        return self._payload.sensing(np.array(time), R_WS)

    def _chain(self, context: Context, time: float) -> tuple[np.ndarray, np.ndarray]:
        """Returns the reading (6,) without noise, and the memories (m,) up to now."""
        load, effects = self.load(context), self.effects(context)
        memories = context.get_discrete_state(self._memory).value()
        if not effects:
            return load, memories
        interval = time - context.get_discrete_state(self._remembered).value()[0]
        if np.isnan(interval):
            interval, memories = 0.0, np.full_like(memories, np.nan)
        sensing = self._sensing(context, time)
        return sensed_sample(load, effects, sensing, memories, max(interval, 0.0))

    def _update(self, context: Context, state: DiscreteValues) -> EventStatus:
        if not memory_size(self.effects(context)):
            return EventStatus.DidNothing()
        if not self.load(context).any():  # no step yet, so nothing to remember
            return EventStatus.DidNothing()
        time = self._sample_time(context)
        _, memories = self._chain(context, time)
        state.set_value(self._memory, memories)
        state.set_value(self._remembered, [time])
        return EventStatus.Succeeded()

    def _calc_wrench(self, context: Context, output: BasicVector) -> None:
        wrench, _ = self._chain(context, self._sample_time(context))
        wrench = wrench + self._noise * self._noise_port.Eval(context)
        output.SetFromVector(quantise(wrench, self._quantum))

    def _calc_health(self, context: Context, output: BasicVector) -> None:
        stepped = self._source.load(context).any()
        output.SetFromVector([Health.READY if stepped else Health.NO_DATA])

    def _calc_time(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector([self._sample_time(context)])

    def _sample_time(self, context: Context) -> float:
        return newest_step(context.get_time(), self._time_step)


def _refuse_too_many_memories(effects: Sequence[SensorEffect]) -> None:
    if memory_size(effects) > MOST_REMEMBERED:
        names = ", ".join(type(e).__name__ for e in effects if memory_size([e]))
        raise DisasmError(
            f"effects: {names} remember more than a sensor has room for; take some out"
        )


def quantise(values: Array, quantum: Array) -> Array:
    """Returns values rounded to whole multiples; a zero quantum leaves them."""
    xp = namespace(values)
    step = xp.where(quantum > 0.0, quantum, 1.0)
    return xp.where(quantum > 0.0, xp.round(values / step) * step, values)
