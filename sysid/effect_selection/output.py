"""A closed loop as plain data, for `result.json`."""

import dataclasses
from typing import Any

from sysid.effect_selection.close_loop import ClosedLoop
from sysid.effect_selection.evidence import Evidence
from sysid.effect_selection.fit import Fit
from sysid.effect_selection.held_out import HeldOut
from sysid.effect_selection.residual_diagnosis import diagnose
from sysid.effect_selection.residual_model import ResidualModel
from sysid.effect_selection.search import SelectionRound
from sysid.effect_selection.survey import Survey
from sysid.effect_selection.verdict import Verdict
from sysid.models.effects import field_of

_DEPENDENCES = 10  # listed of each survey, the best ones: a size, no threshold


def to_mapping(closed: ClosedLoop) -> dict[str, Any]:
    """Returns everything that a program may want to know of a closed loop."""
    before, after = (
        diagnose(fit, survey)
        for fit, survey in ((closed.first, closed.begin), (closed.last, closed.end))
    )
    return {
        **_verdict(closed.verdict),
        "model_parameters": _of_model(closed.last),
        "sentence": closed.sentence,
        "not_told_apart": closed.not_told_apart,
        "text": closed.text,
        "provisional": closed.is_provisional,
        "errors": _errors(closed.errors),
        "channels_made_worse": closed.last.harmed_channels(closed.first),
        "residual_before": [dataclasses.asdict(channel) for channel in before],
        "residual_after": [dataclasses.asdict(channel) for channel in after],
        "rounds": [_round(each) for each in closed.rounds],
        "end": _survey(closed.end),
    }


def _of_model(fit: Fit) -> dict[str, Any]:
    """Returns the values of the parameters that the model has without effects."""
    own = zip(fit.model.parameters, fit.theta.tolist(), strict=True)
    return {
        parameter.name: {"value": value, "unit": parameter.unit}
        for parameter, value in own
        if not field_of(parameter)
    }


def _verdict(found: Verdict) -> dict[str, Any]:
    return {
        "ending": found.ending,
        "effects": list(found.names),
        "rise_without": dict(zip(found.names, found.gains, strict=True)),
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
                "excludes_null": value.excludes_null,
                "is_at_bound": value.is_at_bound,
            }
            for value in found.values
        },
        "dependence_left": found.dependence,
        "left_in_channels": [dataclasses.asdict(each) for each in found.findings],
        "would_have_been_found": [dataclasses.asdict(each) for each in found.limits],
        "share_explained": found.explained,
        "undecided": [dataclasses.asdict(each) for each in found.undecided],
        "left_over": [dataclasses.asdict(each) for each in found.left_over],
        "residual_model": _residual_model(found.residual_model),
    }


def _residual_model(found: ResidualModel | None) -> dict[str, Any] | None:
    if found is None:
        return None
    errors = {e.channel: dataclasses.asdict(e) for e in found.errors}
    return {"physical": False, "effect": found.kind.__name__, "errors": errors}


def _errors(errors: HeldOut) -> dict[str, Any]:
    ends = {"before": errors.before, "after": errors.after}
    rms = {key: errors.rms(p) for key, p in ends.items()}
    intervals = {key: errors.interval(p) for key, p in ends.items()}
    own = errors.model_error_rms
    return {
        "rows": errors.how,
        "in_noise": {k: errors.in_noise(p) for k, p in ends.items()},
        "relative": {k: errors.relative(p) for k, p in ends.items()},
        "rms": {k: errors.rms_by_unit(p) for k, p in ends.items()},
        "channels": {
            channel.name: {
                "unit": channel.unit,
                "noise": channel.noise,
                "model_error": None if own is None else float(own[i]),
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


def _round(each: SelectionRound) -> dict[str, Any]:
    return {
        "added": each.chosen.name,
        "objective": each.objective,
        "ties": [tie.name for tie in each.ties],
        **_survey(each.survey),
    }


def _survey(survey: Survey) -> dict[str, Any]:
    return {
        "blocks": survey.blocks,
        "untested": list(survey.untested),
        "candidates": [_evidence(e) for e in survey.effects],
        "dependences": [_evidence(e) for e in survey.dependences[:_DEPENDENCES]],
    }


def _evidence(evidence: Evidence) -> dict[str, Any]:
    return {
        "name": evidence.name,
        "gain": evidence.gain,
        "p": evidence.p,
        "share_of_blocks": evidence.block_share,
        "parameters": evidence.parameter_count,
        "passes": evidence.accepted,
    }
