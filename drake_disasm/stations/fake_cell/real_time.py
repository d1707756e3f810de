"""A played cell in real time."""

import time

from drake_disasm.stations.fake_cell.cell import FakeCell


class RealTime:
    """Keeps a cell to real time; time that its machine loses stays lost.

    A cell that made up for it would send bursts, as no device does.

    Attributes:
        lost: so far [s].

    Args:
        cell: that is advanced, a control period before each `keep`.
    """

    def __init__(self, cell: FakeCell) -> None:
        self._cell, self._period = cell, cell.station.control_period
        self._due, self.lost = time.monotonic() + self._period, 0.0

    def keep(self) -> None:
        """Waits for the end of the period; skips those that have passed already."""
        late = time.monotonic() - self._due
        if late < 0.0:
            time.sleep(-late)
        skipped = int(max(0.0, late) / self._period)
        if skipped:
            self._cell.skip(skipped)
            self.lost += skipped * self._period
        self._due += (1 + skipped) * self._period
