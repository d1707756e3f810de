"""What has changed since reference logs, in plain English and as plain data."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from drake_disasm.effects import amplitudes
from sysid.effect_selection.changes import Changes, Course, Onset
from sysid.effect_selection.contradictions import Contradiction
from sysid.effect_selection.detection import DetectionLimit
from sysid.effect_selection.effect_names import effect_class, in_words
from sysid.effect_selection.output import to_mapping
from sysid.effect_selection.verdict_words import (
    contradiction_parts,
    effect_lines,
    error_in_words,
    named_effects,
)


def changes_sentence(changes: Changes) -> str:
    """Returns what has changed in a few sentences, and what is left."""
    closed, verdict = changes.closed, changes.closed.verdict
    newer = closed.errors.of_episodes(changes.newer)
    said = ["Provisional, the time was over:"] if closed.is_provisional else []
    said += map(_difference_text, changes.reference.verdict.contradictions)
    if verdict.names:
        said += named_effects(verdict)
        what = "these changes" if len(verdict.names) > 1 else "this change"
        error = error_in_words(newer)
        said.append(f"With {what} the held-out error of the new logs {error}.")
        if changes.leaves_more:
            said.append("That is still more than the references'.")
        return " ".join(said)
    if changes.leaves_more:
        said.append(
            "The new logs are explained less well than the references, and no change "
            "of the library explains why: the noise, or something else, is larger."
        )
    else:
        said.append("Nothing has changed since the reference that these logs show.")
    of_known = error_in_words(closed.errors.of_episodes(range(changes.known)))
    said.append(
        f"The held-out error of the new logs {error_in_words(newer)}; that of the "
        f"references {of_known}."
    )
    return " ".join(said)


def changes_text(changes: Changes) -> str:
    """Returns the changes in lines: the verdict, since when, how they go on, limits."""
    closed = changes.closed
    lines = [f"reference: {changes.reference.sentence}", changes_sentence(changes)]
    lines += effect_lines(closed.verdict)
    if changes.onset:
        lines.append(_onset_text(changes.onset))
    if changes.courses:
        lines.append("in each log:")
        lines += [_course_text(each) for each in changes.courses]
    if unchanged := _limits_text(closed.verdict.limits):
        lines.append(f"all else has changed by less than: {unchanged}")
    return "\n".join(lines)


def changes_mapping(changes: Changes) -> dict[str, Any]:
    """Returns everything that a program may want to know of changes."""
    return {
        **to_mapping(changes.closed),
        "sentence": changes_sentence(changes),
        "text": changes_text(changes),
        "reference": to_mapping(changes.reference),
        "onset": dataclasses.asdict(changes.onset) if changes.onset else None,
        "courses": [
            {
                "episode": course.episode,
                "parameters": {
                    v.name: {
                        "value": v.value,
                        "unit": v.unit,
                        "interval_95": list(v.interval),
                    }
                    for v in course.values
                },
            }
            for course in changes.courses
        ],
    }


def _difference_text(found: Contradiction) -> str:
    """Returns which references already differ, and by what."""
    one, other, kind = contradiction_parts(found)
    return (
        f"The references already differ, {one} from {other} by {kind}: name those "
        "alone that are of one state."
    )


def _onset_text(onset: Onset) -> str:
    """Returns since when the changes act."""
    last = onset.row + onset.rows - 1
    return f"since rows {onset.row} to {last} of {onset.episode}"


def _course_text(course: Course) -> str:
    sized = [v for v in course.values if v.null is not None]
    values = [
        f"{v.name} {v.value:.3g} ({v.interval[0]:.3g} to {v.interval[1]:.3g}) {v.unit}"
        for v in sized
    ]
    return f"  {course.episode}: {'; '.join(values)}"


def _limits_text(limits: Sequence[DetectionLimit]) -> str:
    """Returns by how much each kind could have changed unseen, over all joints.

    By the first of its amplitudes, in the shape that shows best.
    """
    best: dict[str, dict[str, float]] = {}
    units: dict[str, str] = {}
    for each in limits:
        kind = each.effect.partition(".")[0]
        known = effect_class(kind)
        is_first = known is not None and each.field == amplitudes(known)[0]
        if is_first and each.amplitude is not None:
            own = best.setdefault(kind, {})
            own[each.effect] = min(own.get(each.effect, np.inf), abs(each.amplitude))
            units[kind] = "" if each.unit == "1" else f" {each.unit}"
    said = []
    for kind, of_joints in best.items():
        low, high = min(of_joints.values()), max(of_joints.values())
        size = f"{low:.2g}" if low == high else f"{low:.2g} to {high:.2g}"
        said.append(f"{in_words(kind)} {size}{units[kind]}")
    return "; ".join(said)
