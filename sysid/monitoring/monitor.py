"""Judges episodes one after the other: whether the robot has changed, and in what."""

import dataclasses
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from drake_disasm.logs import Log
from sysid.fitting.settings import DEFAULT_SETTINGS
from sysid.monitoring.detector import WINDOW, Array, Evidence, ShiftDetector
from sysid.monitoring.episodes import Course, Episodes
from sysid.monitoring.judgement import Judgement, Suspect, verdict_command
from sysid.monitoring.linear_episode import EpisodeNumbers
from sysid.monitoring.reference import Reference
from sysid.monitoring.statistics import Statistics

#: Episodes in good order before any is judged: of two, the scatter is unknown to a
#: factor of thirty.
LEAST_REFERENCE = 3
#: Of the reference's rows: a shorter episode scatters by 1.4 times as much, or more.
LEAST_ROWS = 0.5
OWN = "reference "  # in front of the number of an episode of the reference
_SUSPECTS = 3
_RECENT = 20  # judgements that the page lists
#: Evidence with which a statistic has surely shifted, once an alarm is raised; or with
#: a tenth of the best one's. Beyond, it says how many episodes there are, not which
#: effect it is.
_SURE, _TENTH = math.log(100.0), math.log(10.0)
#: Of the residual since a change: if no effect explains so much, that is said.
_EXPLAINED = 0.5
_UNDERFLOW = -300.0  # logarithm of no evidence at all, for JSON


class Monitor:
    """The last episodes, what is found in them, and what was said.

    Attributes:
        statistics: of an episode.
        every: mean number of episodes between false alarms.
        nominal: file of the reference's scenario, for the command of an alarm.
        baseline: episodes in good order: those of the reference, or the first new ones
            if it has too few.
        history: the last of those and of the episodes since.
        starts: number of these last ones.
        count: number of episodes that came.
        alarms: number of alarms.
        course: of the evidence.
        recent: the last judgements, as plain data.
    """

    def __init__(
        self,
        statistics: Statistics,
        baseline: Episodes,
        every: float,
        nominal: Path | None = None,
    ) -> None:
        """Knows the reference's episodes, and no other.

        Args:
            statistics: of an episode.
            baseline: episodes of the reference.
            every: mean number of episodes between false alarms.
            nominal: file of the reference's scenario, if one was given.
        """
        self.statistics, self.every, self.nominal = statistics, every, nominal
        self.baseline = baseline.last(WINDOW)
        self.count = self.alarms = 0
        self.course, self.recent = Course(np.zeros((0, 2))), list[dict[str, Any]]()
        self.restart()

    @classmethod
    def of(
        cls, reference: Reference, every: float, nominal: Path | None = None
    ) -> "Monitor":
        """Returns the monitor that begins with a reference.

        Raises:
            DisasmError: a log of the reference is gone or has changed.
        """
        logs = reference.read_logs()
        statistics = Statistics.of(reference, logs)
        baseline = Episodes.none(statistics)
        for number, numbers in enumerate(statistics.of_reference(logs), start=1):
            baseline = baseline.added(f"{OWN}{number}", numbers)
        return cls(statistics, baseline, every, nominal)

    def restart(self) -> None:
        """Forgets all episodes since the reference."""
        self.history, self.starts = self.baseline, 0

    @property
    def reference(self) -> Reference:
        """Whose model it is."""
        return self.statistics.reference

    @property
    def detector(self) -> ShiftDetector:
        """Of shifts in the history."""
        weights, floors = self.statistics.weights, self.statistics.floors
        return ShiftDetector(weights, floors, self.history.values, self.starts)

    @property
    def missing(self) -> int:
        """How many of the next episodes serve as reference."""
        return max(0, LEAST_REFERENCE - len(self.baseline))

    @property
    def has_own_reference(self) -> bool:
        """Whether the reference's episodes serve as such, not the first new ones."""
        return bool(self.baseline) and self.baseline.names[0].startswith(OWN)

    @property
    def has_alarm(self) -> bool:
        """Whether the last episode raised an alarm."""
        return bool(self.recent) and bool(self.recent[-1].get("alarm"))

    def judge(self, log: Log) -> Judgement:
        """Returns what is said of a log of one episode, which is added.

        Raises:
            DisasmError: the log is of another robot, or lacks what the model needs.
        """
        episode = int(log.episodes[0].name.rpartition("_")[2])
        return self.judge_numbers(log.folder, episode, self.statistics.of_episode(log))

    def judge_numbers(
        self, folder: Path, episode: int, numbers: EpisodeNumbers
    ) -> Judgement:
        """Returns what is said of what an episode shows; see `judge`.

        Args:
            folder: of its log.
            episode: number in the log.
            numbers: that it shows.
        """
        name = f"{folder.name}/episode_{episode:04d}"
        self._leave_out_reference(numbers.rows)
        usual = float(np.median(self.baseline.rows)) if self.baseline else 0.0
        if numbers.rows < LEAST_ROWS * usual:
            few = f"has {numbers.rows} rows, the reference's episodes have {usual:.0f}"
            return self.skip(folder, episode, f"{few}; record as long ones")
        self.count += 1
        said = Judgement(self.count, folder, episode, "reference", numbers.rows)
        if self.missing:
            self.baseline = self.baseline.added(name, numbers)
            self.restart()
            return self._said(said)
        return self._said(self._judged(said, name, numbers))

    def skip(self, folder: Path, episode: int, reason: str) -> Judgement:
        """Returns that an episode is skipped, and why."""
        self.count += 1
        return self._said(
            Judgement(self.count, folder, episode, "skipped", reason=reason)
        )

    def _said(self, judgement: Judgement) -> Judgement:
        self.recent = [*self.recent, judgement.to_mapping()][-_RECENT:]
        return judgement

    def _leave_out_reference(self, rows: int) -> None:
        """Leaves the reference's episodes out if they are too few, or far longer.

        Longer ones scatter less than the new ones.
        """
        if self.starts or not self.has_own_reference:
            return
        if self.missing or rows < LEAST_ROWS * np.median(self.baseline.rows):
            self.baseline = Episodes.none(self.statistics)
            self.restart()

    def _judged(self, said: Judgement, name: str, numbers: EpisodeNumbers) -> Judgement:
        """Returns what is said of one more episode."""
        self.history = self.history.added(name, numbers).last(2 * WINDOW)
        self.starts = min(self.starts + 1, WINDOW)
        found = self.detector.evidence()
        value = _log10(found.log_total)
        self.course.add(self.count, value)
        is_alarm = found.log_total >= math.log(self.every)
        suspects = self._named(found) if is_alarm else self._suspects(found)
        said = dataclasses.replace(
            said,
            role="judged",
            log10_evidence=value,
            suspects=tuple(suspects),
            is_alarm=is_alarm,
        )
        if not is_alarm:
            return said
        self.alarms += 1
        command = verdict_command(self.reference, said, self.nominal)
        return dataclasses.replace(said, command=command)

    def _suspects(self, found: Evidence, most: int = _SUSPECTS) -> list[Suspect]:
        """Returns the statistics with most evidence, one of each name."""
        best: dict[str, int] = {}
        for number in np.argsort(-found.log_each, kind="stable").tolist():
            best.setdefault(self.statistics.all[number].name, number)
        return [
            self._suspect(found, number, self.detector.start(number))
            for number in list(best.values())[:most]
        ]

    def _named(self, found: Evidence) -> list[Suspect]:
        """Returns what is suspected at an alarm, that which explains most first.

        Of all that has surely shifted. An effect is ambiguous with the first if it
        explains about as much, and the one with the fewest amplitudes comes first. A
        residual is named if no effect explains half of what the loss has grown by.
        """
        start = self.detector.start(int(np.argmax(found.log_each)))
        least = min(float(found.log_each.max()) - _TENTH, _SURE)
        shares, best = self._shares(start), dict[str, int]()
        numbers = np.flatnonzero(found.log_each >= least)
        sure = {self.statistics.all[i].name for i in numbers}
        for i in np.lexsort([-found.log_each, -shares]).tolist():
            if self.statistics.all[i].name in sure:
                best.setdefault(self.statistics.all[i].name, i)
        known = list(best.values())
        effects = [i for i in known if not self.statistics.all[i].is_residual]
        residuals = [i for i in known if self.statistics.all[i].is_residual]
        most = float(shares[effects[0]]) if effects else 0.0
        room = DEFAULT_SETTINGS.ambiguity_margin * max(min(most, 1.0 - most), 0.0)
        named = [i for i in effects if shares[i] >= most - room]
        named.sort(key=lambda i: self.statistics.all[i].amplitudes)
        named += residuals * (most < _EXPLAINED)
        return [self._suspect(found, i, start, float(shares[i])) for i in named]

    def _shares(self, start: int) -> Array:
        """Returns the share (K,) of what the loss has grown by that effects explain.

        All amplitudes of an effect in one shape, which are the same since a start; less
        what they explain before, at zero for a robot in good order.
        """
        begin = len(self.history) - self.starts + start
        before = self.history.select(slice(0, begin))
        since = self.history.select(slice(begin, None))
        groups = self.statistics.groups
        gain = since.gains(groups) - before.gains(groups)
        growth = float(since.losses.mean() - before.losses.mean())
        found = np.zeros(len(self.statistics.all))
        for group, own in zip(groups, gain, strict=True):
            found[group.start : group.stop] = own
        return found / growth if growth > 0.0 else found / since.losses.mean()

    def _suspect(
        self, found: Evidence, number: int, start: int, share: float = 0.0
    ) -> Suspect:
        """Returns a statistic that has shifted since a start, and by how much."""
        shift = self.detector.shift(number, start)
        name = self.history.names[len(self.history) - shift.age]
        evidence = _log10(float(found.log_each[number]))
        return Suspect(self.statistics.all[number], evidence, share, shift, name)

    def to_archive(self) -> tuple[dict[str, Any], dict[str, Any]]:
        """Returns all that it has come to, as arrays and plain data."""
        arrays = self.baseline.to_arrays("baseline") | self.history.to_arrays("history")
        return arrays | {"course": self.course.points}, {
            "statistics": self.statistics.to_mapping(),
            "starts": self.starts,
            "count": self.count,
            "alarms": self.alarms,
            "recent": self.recent,
        }

    @classmethod
    def from_archive(
        cls,
        reference: Reference,
        arrays: Mapping[str, Array],
        plain: Mapping[str, Any],
        every: float,
        nominal: Path | None = None,
    ) -> "Monitor":
        """Returns what `to_archive` gave."""
        statistics = Statistics.from_mapping(reference, plain["statistics"])
        baseline = Episodes.from_arrays("baseline", arrays)
        found = cls(statistics, baseline, every, nominal)
        found.history = Episodes.from_arrays("history", arrays)
        found.starts, found.recent = plain["starts"], plain["recent"]
        found.count, found.alarms = plain["count"], plain["alarms"]
        found.course = Course(arrays["course"])
        return found


def _log10(logarithm: float) -> float:
    """Returns the logarithm to base ten of a natural one, never minus infinity."""
    return max(logarithm / math.log(10.0), _UNDERFLOW)
