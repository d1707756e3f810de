"""How far a diagram falls behind real time, and which of its parts is slow."""

import dataclasses
from collections import deque
from collections.abc import Mapping

from drake_disasm.common.stopwatch import Stopwatch

#: What is called beside the parts of the diagram that have a stopwatch.
REST = "the rest of the program"

_WAITING = "waiting"
_LOOKS = 20  # in a window


@dataclasses.dataclass(frozen=True)
class Lag:
    """What happened of late.

    Attributes:
        window: the length of the past that is looked at [s].
        slipped: of that, by how much the diagram fell behind [s].
        shares: what each part of the diagram took in the window, by name, as a part
            of the diagram's own time: above 1 it can't keep up.
        took: what each part took since the last look [s].
    """

    window: float = 0.0
    slipped: float = 0.0
    shares: Mapping[str, float] = dataclasses.field(default_factory=dict)
    took: Mapping[str, float] = dataclasses.field(default_factory=dict)

    @property
    def shares_in_words(self) -> str:
        """Each part's share, greatest first."""
        ordered = sorted(self.shares.items(), key=lambda item: -item[1])
        return ", ".join(f"{name} {100 * share:.0f} %" for name, share in ordered)

    @property
    def slowest(self) -> tuple[str, float]:
        """The part that took longest since the last look, and how long [s]."""
        return max(self.took.items(), key=lambda item: item[1], default=(REST, 0.0))


@dataclasses.dataclass(frozen=True)
class _Look:
    """What had been added up at a time: times [s], all but the first in total."""

    now: float
    slipped: float
    totals: Mapping[str, float]

    def taken_since(self, then: "_Look") -> dict[str, float]:
        """Returns what each part took since another look, and the rest [s]."""
        took = {n: total - then.totals.get(n, 0.0) for n, total in self.totals.items()}
        took[REST] = max(0.0, self.now - then.now - sum(took.values()))
        del took[_WAITING]
        return took


class LagMonitor:
    """Remembers a window of the past: how much time slipped, and who took it.

    Attributes:
        stopwatches: of the diagram's parts, by name; more may be added.

    Args:
        window: that is looked at [s].
    """

    def __init__(self, window: float) -> None:
        self.stopwatches: dict[str, Stopwatch] = {}
        self._window = window
        self.begin()

    def begin(self) -> None:
        """Forgets the past, as between episodes."""
        self._past: deque[_Look] = deque()
        self._last: _Look | None = None

    def update(self, now: float, slipped: float, waited: float) -> Lag:
        """Returns the newest window's lag.

        Args:
            now: real time [s].
            slipped: so far, in all [s].
            waited: so far, with nothing to do [s].
        """
        totals = {name: watch.total for name, watch in self.stopwatches.items()}
        look = _Look(now, slipped, totals | {_WAITING: waited})
        last, self._last = self._last or look, look
        past = self._past
        if not past or now - past[-1].now >= self._window / _LOOKS:
            past.append(look)
        while len(past) > 1 and past[1].now <= now - self._window:
            past.popleft()
        then = past[0]
        window, slip = now - then.now, slipped - then.slipped
        diagrams = max(window - slip, self._window / _LOOKS)
        shares = {n: took / diagrams for n, took in look.taken_since(then).items()}
        return Lag(window, slip, shares, look.taken_since(last))
