"""A verdict as plain data, for `result.json`."""

import dataclasses
from typing import Any

from sysid.effect_selection.close_loop import Closed
from sysid.effect_selection.evidence import Evidence
from sysid.effect_selection.held_out import HeldOut
from sysid.effect_selection.residual_diagnosis import diagnose
from sysid.effect_selection.search import Survey


def to_mapping(closed: Closed) -> dict[str, Any]:
    """Returns everything that a program may want of a verdict."""
    found = closed.verdict
    return {
        "ending": found.ending,
        "effects": list(found.names),
        "rise_without": dict(zip(found.names, found.worth, strict=True)),
        "ties": {
            name: {tie.name: tie.experiment for tie in ties}
            for name, ties in zip(found.names, found.ties, strict=True)
        },
        "contradictions": [dataclasses.asdict(c) for c in found.contradictions],
        "parameters": {
            value.name: {
                "value": value.value,
                "unit": value.unit,
                "interval_95": list(value.interval),
                "excludes_null": value.matters,
            }
            for value in found.values
        },
        "dependence_left": found.dependence,
        "share_explained": found.explained,
        "text": found.text,
        "errors": _errors(closed.errors),
        "residual_before": [
            dataclasses.asdict(d) for d in diagnose(closed.first, closed.begin)
        ],
        "residual_after": [
            dataclasses.asdict(d) for d in diagnose(closed.last, closed.end)
        ],
        "rounds": [
            {
                "added": r.chosen.name,
                "objective": r.value,
                "ties": [tie.name for tie in r.ties],
                **_survey(r.survey),
            }
            for r in closed.rounds
        ],
        "end": _survey(closed.end),
    }


def _errors(errors: HeldOut) -> dict[str, Any]:
    ends = {"before": errors.before, "after": errors.after}
    rms = {key: errors.rms(p) for key, p in ends.items()}
    intervals = {key: errors.interval(p) for key, p in ends.items()}
    return {
        "rows": errors.how,
        "in_noise": {k: errors.in_noise(p) for k, p in ends.items()},
        "relative": {k: errors.relative(p) for k, p in ends.items()},
        "rms": {k: errors.rms_by_unit(p) for k, p in ends.items()},
        "channels": {
            channel.name: {
                "unit": channel.unit,
                "noise": channel.noise,
                **{
                    key: {
                        "rms": float(rms[key][i]),
                        "interval_95": intervals[key][i].tolist(),
                    }
                    for key in ends
                },
            }
            for i, channel in enumerate(errors.channels)
        },
    }


def _survey(survey: Survey) -> dict[str, Any]:
    return {
        "blocks": survey.blocks,
        "candidates": [_evidence(e) for e in survey.effects],
        "dependences": [_evidence(e) for e in survey.dependences[:10]],
    }


def _evidence(evidence: Evidence) -> dict[str, Any]:
    return {
        "name": evidence.name,
        "gain": evidence.gain,
        "p": evidence.p,
        "share_of_blocks": evidence.share,
        "parameters": evidence.cost,
        "passes": evidence.accepted,
    }
