"""Decides what is sent to the arm: what is wanted, or the place where it was held."""

import enum
from collections.abc import Sequence

import numpy as np

from drake_disasm.safety.guards import Guard, Situation
from drake_disasm.safety.retreat import Retreat

#: Share of the joints' velocity limit at which a hold is gone to: by default about the
#: speed of the task's own motion. An arm that leans on something springs back. Pressed
#: against the fake cell's groove until a hold, 59 N in place of 76 N followed about z
#: at a share of 0.2, 53 N at 0.05, for 10 ms each. An arm in impedance control has a
#: longer way back, but its damper pushes with the command's speed: at half the velocity
#: limit 83 N followed out of the plate, at a tenth 23 N.
HOLD_SHARE = 0.1


class Mode(enum.Enum):
    """What the supervisor lets through."""

    WAITING = "waiting"  # nothing moves until all is ready and command = measurement
    ACTIVE = "active"
    HOLD = "hold"  # latched: only `resume` ends it


class Supervisor:
    """Lets commands through while no guard objects; else latches a hold.

    The hold is at the measured position. It lives here and not in a Context, since
    the robot does not go back in time when a diagram is reset.

    Attributes:
        mode: see Mode.
        reason: why it holds or waits; empty while active.
        held_since: when it tripped, by the devices' clock [s]; NaN without a hold.
        clamped: how many commands were shortened to the velocity limit.

    Args:
        guards: asked in their order; the first that objects is the reason.
        max_velocity: (7,) of the joints, from one command to the next [rad/s].
        start_tolerance: between command and measurement when motion begins [rad].
        max_jump: of a measured joint between two looks, beyond which it is no place
            to hold at [rad].
        retreat: moves the place of a hold away from what presses; None stays.
    """

    def __init__(
        self,
        guards: Sequence[Guard],
        max_velocity: np.ndarray,
        start_tolerance: float,
        max_jump: float,
        retreat: Retreat | None = None,
    ) -> None:
        self.mode, self.reason, self.clamped = Mode.WAITING, "not begun", 0
        self.held_since = np.nan
        self._guards, self._max_velocity = tuple(guards), max_velocity
        self._why = ""  # without what was done about it since
        self._tolerance, self._max_jump = start_tolerance, max_jump
        self._retreat = retreat
        self._held: np.ndarray | None = None
        self._sent: np.ndarray | None = None
        self._sent_before: np.ndarray | None = None

    def command(self, situation: Situation) -> np.ndarray:
        """Returns what to send (7,) [rad]; NaN while nothing was ever measured."""
        if self.mode is Mode.WAITING:
            self._wait(situation)
        elif self.mode is Mode.ACTIVE:
            self._watch(situation)
        elif self._retreat and self._held is not None:
            self._held = self._retreat.advance(self._held, situation)
            self.reason = self._why + self._retreat.words
        wanted = situation.q_wanted if self.mode is Mode.ACTIVE else self._held
        if wanted is None:
            return np.full_like(situation.q_measured, np.nan)
        self._sent_before = self._sent
        share = HOLD_SHARE if self.mode is Mode.HOLD else 1.0
        self._sent = self._within_reach(wanted, share * situation.since_sent)
        return self._sent

    def withdraw(self) -> None:
        """Takes note that the last command was not sent after all."""
        self._sent = self._sent_before

    def refuse(self, reason: str, now: float) -> None:
        """Takes note that nothing can be sent now [s]; whoever moves is held.

        What would go on meanwhile would have to be made up for.
        """
        self.withdraw()
        if self.mode is Mode.ACTIVE and self._sent is not None:
            self.trip(reason, self._sent, now)

    def begin(self) -> None:
        """Waits anew, wherever the arm was taken meanwhile; a hold stays one."""
        if self.mode is not Mode.HOLD:
            self.mode, self.reason, self._held = Mode.WAITING, "begins", None

    def resume(self) -> None:
        """Ends a hold: motion begins again once all is ready and nothing leaps."""
        if self.mode is Mode.HOLD:
            self.mode, self.held_since = Mode.WAITING, np.nan
            self.begin()

    def trip(self, reason: str, q_held: np.ndarray, now: float) -> None:
        """Latches a hold (7,) [rad] at a time [s]; the first reason stays."""
        if self.mode is not Mode.HOLD:
            self.mode, self.reason, self._held = Mode.HOLD, reason, q_held
            self._why, self.held_since = reason, now

    def _wait(self, situation: Situation) -> None:
        if self._held is None and np.isfinite(situation.q_measured).all():
            self._held = self._sent = situation.q_measured
        self.reason = self._objection(situation) or self._apart(situation)
        if not self.reason:
            self.mode = Mode.ACTIVE

    def _watch(self, situation: Situation) -> None:
        if reason := self._objection(situation):
            self.trip(reason, self._believed(situation), situation.now)
            if self._retreat:
                self._retreat.begin(situation)

    def _objection(self, situation: Situation) -> str:
        return next((r for guard in self._guards if (r := guard(situation))), "")

    def _apart(self, situation: Situation) -> str:
        apart = float(np.abs(situation.q_wanted - situation.q_measured).max())
        if apart <= self._tolerance:
            return ""
        return f"the command is {apart:.4f} rad from where the arm is"

    def _within_reach(self, wanted: np.ndarray, since_sent: float) -> np.ndarray:
        """Returns the way there, no further than the time since then allows."""
        assert self._sent is not None
        step, most = wanted - self._sent, since_sent * self._max_velocity
        short = np.clip(step, -most, most)
        self.clamped += int(not np.array_equal(step, short))
        return self._sent + short

    def _believed(self, situation: Situation) -> np.ndarray:
        """Returns where the arm is (7,), as last believed.

        A measurement that is NaN, or that leaped, is no place to go to.
        """
        now, before = situation.q_measured, situation.q_before
        if not np.isfinite(now).all():
            return before
        leaped = np.abs(now - before).max() > self._max_jump  # not where before is NaN
        return before if leaped else now
