"""What to record next, and what a log would have shown, kind of effect by kind."""

from dataclasses import dataclass

import numpy as np

from sysid.effect_selection.detection import DetectionLimit
from sysid.effect_selection.effect_names import effect_class, enumeration, in_words
from sysid.effect_selection.experiments import revealing_kind
from sysid.effect_selection.verdict import Verdict
from sysid.effect_selection.verdict_words import kind_lines


@dataclass(frozen=True)
class Recording:
    """A recording that is worth making.

    Attributes:
        purpose: what it would decide, in words.
        what: to record.
    """

    purpose: str
    what: str


@dataclass(frozen=True)
class LimitRow:
    """Detection limits of one field of a kind of effect, over all joints.

    Attributes:
        kind: of effect, the class's name.
        words: what a sentence calls it.
        field, meaning, unit: of the amplitude.
        least, greatest: that would have been found, with their joints; None if none.
        hidden: joints where none would have been found within its bounds, or all that
            there is if it acts at none.
        shapes: in which they would have been found: other shapes have to be larger.
    """

    kind: str
    words: str
    field: str
    meaning: str
    unit: str
    least: tuple[float, str] | None
    greatest: tuple[float, str] | None
    hidden: tuple[str, ...]
    shapes: tuple[str, ...]


def recordings(verdict: Verdict, setting: str) -> list[Recording]:
    """Returns what to record next, the most urgent first.

    Args:
        verdict: of a search.
        setting: in which its log was recorded, see `LogModel`.
    """
    lines, found = kind_lines(verdict), []
    for each in (line for line in lines if line.rivals):
        names = [in_words(name) for name in (each.names[0], *each.rivals)]
        purpose = f"whether it is {enumeration(names, 'or')}"
        found += [Recording(purpose, text) for text in each.experiments]
    for each in (line for line in lines if line.status == "suggested"):
        if text := revealing_kind(each.names[0], setting):
            purpose = f"whether it is {in_words(each.names[0])} at all"
            found.append(Recording(purpose, text))
    found += [
        Recording(f"{in_words(kind)}, which this log could not have shown", text)
        for kind in verdict.undetectable
        if (text := revealing_kind(kind, setting))
    ]
    return list(dict.fromkeys(found))


def limit_rows(limits: tuple[DetectionLimit, ...]) -> list[LimitRow]:
    """Returns detection limits with all joints of a kind in one row."""
    groups: dict[tuple[str, str], list[DetectionLimit]] = {}
    for limit in limits:
        kind = limit.effect.partition(".")[0]
        groups.setdefault((kind, limit.field), []).append(limit)
    return [_limit_row(kind, field, own) for (kind, field), own in groups.items()]


def _limit_row(kind: str, field: str, limits: list[DetectionLimit]) -> LimitRow:
    known = effect_class(kind)
    data = known.__dataclass_fields__[field].metadata if known else {}
    found = sorted(
        (abs(limit.amplitude), limit.effect.partition(".")[2])
        for limit in limits
        if limit.amplitude is not None
    )
    hidden = [x.effect.partition(".")[2] for x in limits if x.amplitude is None]
    own = [limit for limit in limits if np.isfinite(limit.share)] or limits
    units = " or ".join(dict.fromkeys(limit.unit for limit in own))
    least, greatest = (found[0], found[-1]) if found else (None, None)
    shapes = dict.fromkeys(x.shape for x in limits if x.shape and x.amplitude)
    return LimitRow(
        kind,
        in_words(kind),
        field,
        str(data.get("doc", "")),
        units,
        least,
        greatest,
        tuple(hidden),
        tuple(shapes),
    )
