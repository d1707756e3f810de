"""The rate of commands: time that was lost stays lost.

A simulator that runs in real time makes up for a stall as fast as it can. On a robot
that is haste: commands at many times their rate, and motion at many times its speed.
So the commands have a pace of their own, which no diagram can exceed. After a stall
the diagram's time stays behind, and the motion goes on at its usual rate.
"""

import dataclasses
from collections.abc import Callable

import numpy as np

from drake_disasm.devices.reading import Clock

#: No command leaves sooner after the one before, in control periods.
MIN_GAP = 0.9
#: A command that is later than this, in control periods, comes after a stall.
STALL = 2.0

_POLL = 0.001  # s, the longest wait at a time: LCM drops what comes behind a message
_ROUNDING = 1e-9  # s


@dataclasses.dataclass
class PaceCounts:
    """What keeping the pace cost.

    Attributes:
        slipped: by how much the diagram's time fell behind real time [s].
        stalls: how often something took more than STALL periods.
        longest_stall: of them, beyond the time that was due [s].
        held: commands that were not sent: a stall came between decision and sending,
            or the arm did not listen.
        waited: for commands' turns [s].
    """

    slipped: float = 0.0
    stalls: int = 0
    longest_stall: float = 0.0
    held: int = 0
    waited: float = 0.0


@dataclasses.dataclass(frozen=True)
class Turn:
    """When a command may be decided on.

    Attributes:
        now: by the clock [s].
        overdue: by how much a stall had made the command late, before the devices
            were looked at [s]; zero without one.
        since_sent: how long after the last command this one leaves [s]: one period
            at most, however long the last one is ago.
    """

    now: float
    overdue: float
    since_sent: float


class Pace:
    """Gives each command its turn, one control period after the last.

    Commands that are a little late, as on any machine without a real-time kernel, are
    made up for by gaps that are a little shorter, by no more than MIN_GAP allows.
    After a stall the schedule begins anew, and some time passes first, in which the
    devices' newest samples arrive: the guards look before the arm moves.

    Each turn ends by `leave` or by `skip`.

    Attributes:
        counts: what it cost so far.

    Args:
        period: of the commands [s].
        clock: the devices'.
        wait: lets a time [s] pass, and receives what comes.
        look: time to pass after a stall [s], in which every device must send.
    """

    def __init__(
        self,
        period: float,
        clock: Clock,
        wait: Callable[[float], None],
        look: float = 0.0,
    ) -> None:
        self._period, self._clock, self._wait = period, clock, wait
        self._look = max(look, period)
        self.counts = PaceCounts()
        self.begin()

    def begin(self) -> None:
        """Forgets the schedule: no command was sent, as between episodes."""
        self._due = self._turn = self._last_sent = np.nan
        self._stalled = 0.0

    def await_turn(self) -> Turn:
        """Waits until the next command is due."""
        while True:
            now = self._clock()
            if now - self._due > STALL * self._period:
                self._slip(now)
            if not now < self._due - _ROUNDING:  # NaN before the first command
                break
            self._let_pass(self._due - now)
        overdue, self._stalled, self._turn = self._stalled, 0.0, now
        passed = np.maximum(now - self._last_sent, MIN_GAP * self._period)
        return Turn(now, overdue, float(np.fmin(passed, self._period)))  # not of NaN

    def is_late(self) -> bool:
        """Returns whether a stall came since the turn; its command must not leave."""
        return self._clock() - self._turn > STALL * self._period

    def leave(self, send: Callable[[], None]) -> None:
        """Sends a command, once the last one is long enough ago."""
        least = MIN_GAP * self._period - _ROUNDING
        while (passed := self._clock() - self._last_sent) < least:
            self._let_pass(least - passed)
        send()
        self._last_sent = self._clock()
        due = self._last_sent if np.isnan(self._due) else self._due
        self._due = due + self._period

    def skip(self) -> None:
        """Takes note that this turn's command is not sent at all."""
        self.counts.held += 1
        if self.is_late():
            self._slip(self._clock())
        else:
            due = self._turn if np.isnan(self._due) else self._due
            self._due = due + self._period

    def _let_pass(self, duration: float) -> None:
        begun = self._clock()
        self._wait(min(_POLL, duration))
        self.counts.waited += self._clock() - begun

    def _slip(self, now: float) -> None:
        """Counts a stall, and begins the schedule anew."""
        due = self._turn if np.isnan(self._due) else self._due
        late, counts = now - due, self.counts
        self._stalled = max(self._stalled, late)
        counts.stalls += 1
        counts.longest_stall = max(counts.longest_stall, late)
        self._due = now + self._look
        counts.slipped += self._due - due
