"""The newest sample of a device, and whether it may be trusted."""

import dataclasses
import threading
import time
from collections.abc import Callable

import numpy as np

from drake_disasm.common.ports import Health

#: A sample that comes so long after it was taken has waited somewhere [s].
QUEUED = 0.02

#: Tells the time [s]; tests that run a cell in step with its fakes give their own.
Clock = Callable[[], float]


@dataclasses.dataclass(frozen=True)
class Counters:
    """What became of packets.

    Attributes:
        received: good ones.
        lost: that should have come between those that did.
        reordered: that came after newer ones, and were dropped.
        invalid: that were no packets of the protocol, and were dropped.
        queued: that came long after they were taken, as all at once after a stall.
        reconnects: how often the connection had to be made again.
    """

    received: int = 0
    lost: int = 0
    reordered: int = 0
    invalid: int = 0
    queued: int = 0
    reconnects: int = 0

    @property
    def text(self) -> str:
        """In words, what was not zero."""
        pairs = dataclasses.asdict(self).items()
        return ", ".join(f"{count} {name}" for name, count in pairs if count)


@dataclasses.dataclass(frozen=True)
class Reading:
    """The newest sample of a device.

    Attributes:
        values: (n,) SI; NaN before the first.
        time: when it was taken, by the client's clock [s]; NaN before the first.
        error: what the device complains of, with the remedy; empty if of nothing.
        counters: what became of packets.
    """

    values: np.ndarray
    time: float = np.nan
    error: str = ""
    counters: Counters = Counters()

    def age(self, now: float) -> float:
        """Returns how old the sample is [s]; infinite before the first."""
        return np.inf if np.isnan(self.time) else now - self.time

    def health(self, now: float, stale_after: float) -> Health:
        """Returns how the device is at a time [s] of the client's clock."""
        if self.error:
            return Health.ERROR
        if np.isnan(self.time):
            return Health.NO_DATA
        return Health.STALE if self.age(now) > stale_after else Health.READY


class Mailbox:
    """Holds the newest reading; a client's thread puts it in, a system takes it."""

    def __init__(
        self, size: int, clock: Clock = time.monotonic, queued_after: float = QUEUED
    ) -> None:
        self.clock, self._queued_after = clock, queued_after
        self._lock = threading.Lock()
        self._reading = Reading(np.full(size, np.nan))

    def read(self) -> Reading:
        """Returns the newest reading."""
        with self._lock:
            return self._reading

    def put(self, values: np.ndarray, time: float | None = None) -> None:
        """Takes a good sample, which clears the error.

        Args:
            values: of the sample.
            time: when it was taken, by the clock [s]; None is now.
        """
        now = self.clock()
        taken = now if time is None else time
        with self._lock:
            queued = int(now - taken > self._queued_after)
            counters = self._counted(received=1, queued=queued)
            self._reading = Reading(np.array(values), taken, "", counters)

    def complain(self, error: str) -> None:
        """Takes an error; the newest sample stays as old as it is."""
        with self._lock:
            self._reading = dataclasses.replace(self._reading, error=error)

    def count(self, **more: int) -> None:
        """Adds to the counters, by name."""
        with self._lock:
            counters = self._counted(**more)
            self._reading = dataclasses.replace(self._reading, counters=counters)

    def _counted(self, **more: int) -> Counters:
        old = self._reading.counters
        return dataclasses.replace(
            old, **{name: getattr(old, name) + n for name, n in more.items()}
        )
