"""What is said of an episode, and of what is suspected."""

import math
import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from sysid.monitoring.detector import Shift
from sysid.monitoring.reference import Reference
from sysid.monitoring.statistics import Statistic

Role = Literal["judged", "reference", "skipped"]


@dataclass(frozen=True)
class Suspect:
    """A statistic and how surely it has shifted.

    Attributes:
        statistic: which.
        log10_evidence: sum over starts of its Bayes factors.
        share: of what the loss has grown by since then, that its effect explains.
        shift: since its most likely start.
        since: that start's log and episode.
    """

    statistic: Statistic
    log10_evidence: float
    share: float
    shift: Shift
    since: str

    def to_mapping(self) -> dict[str, Any]:
        """Returns it as plain data; a residual's shift is a factor of its rms."""
        statistic, ends = self.statistic, [self.shift.value, *self.shift.interval]
        if statistic.is_residual:
            ends = [math.exp(min(end, 700.0)) for end in ends]
        return {
            "name": statistic.name,
            "parameter": statistic.text,
            "log10_evidence": self.log10_evidence,
            "share": self.share,
            "is_factor": statistic.is_residual,
            "value": ends[0],
            "interval_95": ends[1:],
            "unit": statistic.unit,
            "since": self.since,
            "episodes": self.shift.age,
        }


@dataclass(frozen=True)
class Judgement:
    """What is said of an episode.

    Attributes:
        number: of the episode among all that came, from 1.
        folder: of its log.
        episode: number in the log.
        role: what it serves as.
        rows: that were judged.
        log10_evidence: log10 of R_n, all statistics together; None if not judged.
        suspects: what has shifted most surely; at an alarm what explains most comes
            first, and what is ambiguous with it.
        is_alarm: whether R_n is as large as the stated mean number of episodes.
        reason: why it was skipped.
        command: that gives the full verdict on an alarm.
    """

    number: int
    folder: Path
    episode: int
    role: Role
    rows: int = 0
    log10_evidence: float | None = None
    suspects: tuple[Suspect, ...] = ()
    is_alarm: bool = False
    reason: str = ""
    command: str = ""

    @property
    def sentence(self) -> str:
        """The suspected change in plain English; empty without an alarm."""
        if not self.is_alarm:
            return ""
        names = " or ".join(dict.fromkeys(s.statistic.in_words for s in self.suspects))
        first = self.suspects[0].to_mapping()
        low, high = first["interval_95"]
        size = f"{first['value']:.3g} ({low:.3g} to {high:.3g})"
        if first["is_factor"]:
            by = f"is {size} times as large"
        else:
            unit = "" if first["unit"] == "1" else f" {first['unit']}"
            by = f"has changed by {size}{unit}"
        return f"suspected: {names}, since {first['since']}: {first['parameter']} {by}"

    def to_mapping(self) -> dict[str, Any]:
        """Returns it as a line of `episodes.jsonl`."""
        plain: dict[str, Any] = {
            "number": self.number,
            "log": str(self.folder),
            "episode": self.episode,
            "role": self.role,
        }
        if self.reason:
            return plain | {"reason": self.reason}
        plain |= {
            "rows": self.rows,
            "log10_evidence": self.log10_evidence,
            "alarm": self.is_alarm,
            "suspects": [suspect.to_mapping() for suspect in self.suspects],
        }
        if self.is_alarm:
            plain |= {"sentence": self.sentence, "command": self.command}
        return plain


def verdict_command(
    reference: Reference, judgement: Judgement, nominal: Path | None
) -> str:
    """Returns the command that gives the full verdict on an alarm.

    Args:
        reference: of the watch.
        judgement: with the alarm.
        nominal: file of the reference's scenario, if one was given.
    """
    folder, choice = judgement.folder, reference.choice
    since = judgement.suspects[0].since.rpartition("/")[0]
    logs = {folder}
    if since != folder.name:
        known = (path for path in folder.parent.iterdir() if path.is_dir())
        logs |= {path for path in known if since <= path.name <= folder.name}
    words = ["drake-disasm", "close-loop", "--reference"]
    words += [str(path) for path in reference.logs]
    words += ["--log", *sorted(str(path) for path in logs)]
    words += ["--scenario", str(nominal)] if nominal else []
    words += ["--urdf", choice.urdf] if choice.urdf else []
    words += [word for name in reference.imports for word in ("--import", name)]
    words += ["--drop-flagged-rows"] * reference.drop_flagged_rows
    return shlex.join([*words, "--out", f"changed_{judgement.number}"])
