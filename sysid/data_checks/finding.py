"""What a check of the data found, as text and as plain data; rows that it flags."""

import enum
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_disasm.common.errors import DisasmError

#: Kinds of findings, with what each means.
KINDS: Mapping[str, str] = {
    "assumed": "what the model takes for granted, since the log doesn't say it",
    "axes": "axes are swapped or have the wrong sign",
    "contact": "readings of a load whose forces change at one orientation",
    "constant": "a channel never changes, where it should",
    "derivatives": "velocities or accelerations are not the derivatives",
    "late": "a channel is late by whole rows",
    "limits": "speeds or accelerations beyond what the URDF's limits permit",
    "moving": "readings that move, where that shows, or that should be at rest",
    "processing": "wrench is not ft_sensor processed",
    "quantum": "a channel comes in steps coarser than its noise",
    "spikes": "single rows far from their neighbours",
    "still": "no joint of a motion moves, or clearly more than its noise",
    "stuck": "a channel repeats a value over many rows",
    "time": "time jumps, stands, or is not in step with the period",
    "units": "a quantity that is not SI",
    "unrelated": "a torque that shows nothing of its joint's motion",
}
#: Kinds with which data may be fitted all the same; nothing fits a dead channel.
ACCEPTABLE = tuple(kind for kind in KINDS if kind != "constant")
_SHOWN = 3  # rows, and episodes, that a text lists


class Severity(enum.Enum):
    """What follows from a finding."""

    REFUSE = "refuse"  # no fit to these data means anything
    WARN = "warn"  # a fit does, but the reader should know


@dataclass(frozen=True)
class DataFinding:
    """Something that the data are not, though they say so.

    Attributes:
        kind: one of KINDS.
        what: what is wrong, with the names of the columns.
        remedy: what to do.
        severity: what follows from it.
        rows: of the log's tables, from 0, by the episode's name (`log/episode_0003`);
            empty if it is about all of them.
    """

    kind: str
    what: str
    remedy: str
    severity: Severity = Severity.WARN
    rows: Mapping[str, Sequence[int]] = field(default_factory=dict)

    @property
    def text(self) -> str:
        """The finding in one line."""
        where = "; ".join(
            f"{name} {_rows_text(rows)}"
            for name, rows in list(self.rows.items())[:_SHOWN]
        )
        more = " ..." if len(self.rows) > _SHOWN else ""
        where = f" ({where}{more})" if where else ""
        return f"{self.kind}: {self.what}{where}; {self.remedy}"

    @property
    def row_count(self) -> int:
        """How many rows it flags."""
        return sum(len(rows) for rows in self.rows.values())

    def to_mapping(self) -> dict[str, Any]:
        """Returns it as plain data, for `result.json`."""
        return {
            "kind": self.kind,
            "severity": self.severity.value,
            "what": self.what,
            "remedy": self.remedy,
            "rows": {name: [int(r) for r in rows] for name, rows in self.rows.items()},
        }


def _rows_text(rows: Sequence[int]) -> str:
    """Returns numbers in words; consecutive ones as a range."""
    breaks = np.flatnonzero(np.diff(rows) != 1) + 1
    runs = [r for r in np.split(np.asarray(rows), breaks) if len(r)]
    words = [str(r[0]) if len(r) == 1 else f"{r[0]} to {r[-1]}" for r in runs]
    more = " ..." if len(words) > _SHOWN else ""
    return f"row {', '.join(words[:_SHOWN])}{more}"


def rows_of(masks: Mapping[str, NDArray[np.bool_]]) -> dict[str, tuple[int, ...]]:
    """Returns the rows where masks (rows,) are true, of the episodes that have any."""
    found = {n: np.flatnonzero(mask).tolist() for n, mask in masks.items()}
    return {name: tuple(rows) for name, rows in found.items() if rows}


def refuse(findings: Iterable[DataFinding], accepted: Sequence[str] = ()) -> None:
    """Refuses data of which a finding says that no fit to them means anything.

    Args:
        findings: of the data.
        accepted: kinds that are taken as they are.

    Raises:
        DisasmError: there is such a finding, of a kind that is not accepted.
    """
    bad = [
        finding
        for finding in findings
        if finding.severity is Severity.REFUSE and finding.kind not in accepted
    ]
    if bad:
        text = " | ".join(finding.text for finding in bad)
        kinds = dict.fromkeys(finding.kind for finding in bad)
        if set(kinds) <= set(ACCEPTABLE):
            accept = " ".join(kinds)
            text += f", or fit them nevertheless by `accept_findings` {accept}"
        raise DisasmError(text)
