"""A device's own time, by our clock."""

#: By how much a device's clock may run slower than ours [1]. Crystals differ by 1e-4;
#: the larger, the sooner a delay that lasts is taken for the usual one.
DRIFT = 0.01


class DeviceClock:
    """Tells when a sample was taken, from the device's own stamp of it.

    What comes over a network comes late, never early. So the least delay that was
    seen is the difference of the clocks, and a sample that comes later than that has
    waited somewhere: packets that queued up during a stall come all at once, but each
    keeps its own time.
    """

    def __init__(self) -> None:
        self.begin_anew()

    def begin_anew(self) -> None:
        """Forgets the difference, as when a device has restarted."""
        self._least: float | None = None  # delay, plus the clocks' difference [s]
        self._arrival = 0.0

    def taken_at(self, stamp: float, arrival: float) -> float:
        """Returns when a sample was taken, by our clock [s]; not after its arrival.

        Args:
            stamp: the device's own time [s], from any beginning.
            arrival: when the sample came, by our clock [s].
        """
        delay = arrival - stamp
        if self._least is not None:
            forgotten = DRIFT * max(0.0, arrival - self._arrival)
            delay = min(delay, self._least + forgotten)
        self._least, self._arrival = delay, arrival
        return stamp + delay
