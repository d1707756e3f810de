"""A device's newest sample as output ports; its client reads the device."""

from typing import Protocol

import numpy as np
from pydrake.systems.framework import (
    Context,
    DiscreteValues,
    EventStatus,
    LeafSystem,
)

from drake_disasm.devices.reading import Clock, Reading


class Readable(Protocol):
    """A client of a device, or whatever else has a newest sample."""

    def read(self) -> Reading:
        """Returns the newest sample."""


class DeviceReader(LeafSystem):
    """Samples a device's client once per period: values, health, and sample time.

    `time_measured` is in the diagram's time. Before the first sample values are NaN
    and `health` says NO_DATA.

    @system
    name: DeviceReader
    input_ports: []
    output_ports:
    - values
    - health
    - time_measured
    @endsystem

    Args:
        device: that is read.
        size: of its values.
        period: between looks [s].
        stale_after: age of a sample that is too old [s].
        clock: the device's.
    """

    def __init__(
        self,
        device: Readable,
        size: int,
        period: float,
        stale_after: float,
        clock: Clock,
    ) -> None:
        super().__init__()
        self._device, self._clock, self._stale_after = device, clock, stale_after
        self._values = self.DeclareDiscreteState(np.full(size, np.nan))
        self._health = self.DeclareDiscreteState(1)
        self._time = self.DeclareDiscreteState([np.nan])
        self.DeclareInitializationDiscreteUpdateEvent(self._update)
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._update)
        self.DeclareStateOutputPort("values", self._values)
        self.DeclareStateOutputPort("health", self._health)
        self.DeclareStateOutputPort("time_measured", self._time)

    def _update(self, context: Context, state: DiscreteValues) -> EventStatus:
        reading, now = self._device.read(), self._clock()
        health = reading.health(now, self._stale_after)
        state.set_value(self._values, reading.values)
        state.set_value(self._health, [float(health)])
        state.set_value(self._time, [context.get_time() - reading.age(now)])
        return EventStatus.Succeeded()
