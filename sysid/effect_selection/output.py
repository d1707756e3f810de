"""A closed loop as plain data, for `result.json`."""

import dataclasses
from typing import Any

from sysid.effect_selection.close_loop import ClosedLoop
from sysid.effect_selection.forward_selection import Gain, Step
from sysid.effect_selection.replication import Standing
from sysid.effect_selection.verdict import Verdict
from sysid.fitting.fit import Fit
from sysid.models.effects import field_of
from sysid.residuals.held_out import HeldOut
from sysid.residuals.residual_diagnosis import diagnose
from sysid.residuals.residual_model import ResidualModel


def to_mapping(closed: ClosedLoop) -> dict[str, Any]:
    """Returns everything that a program may want to know of a closed loop."""
    before, after = (diagnose(fit) for fit in (closed.first, closed.last))
    found, urdf = closed.search, closed.urdf_difference
    return {
        **_verdict(closed.verdict),
        "model_parameters": _of_model(closed.last),
        "urdf_difference": urdf.to_mapping() if urdf else None,
        "derived": {
            name: {"value": value, "unit": unit}
            for name, (value, unit) in closed.derived.items()
        },
        "sentence": closed.sentence,
        "not_told_apart": closed.not_told_apart,
        "text": closed.text,
        "provisional": closed.is_provisional,
        "errors": _errors(closed.errors),
        "residual_before": [dataclasses.asdict(channel) for channel in before],
        "residual_after": [dataclasses.asdict(channel) for channel in after],
        "steps": [_step(each) for each in found.steps],
        "candidates": [_gain(each) for each in found.begin],
        "untested": list(found.untested),
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
        "confirmed": list(found.confirmed),
        "ambiguous": list(found.ambiguous),
        "suggested": list(found.suggested),
        "standings": [_standing(each) for each in found.standings],
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
        "left_in_channels": [dataclasses.asdict(each) for each in found.findings],
        "would_have_been_found": [dataclasses.asdict(each) for each in found.limits],
        "would_not_have_been_found": found.undetectable,
        "correlated_channels": list(found.correlated),
        "invalid": found.invalid,
        "misfits": list(found.misfits),
        "written": [dataclasses.asdict(each) for each in found.written],
        "left_over": [dataclasses.asdict(each) for each in found.predictable_residual],
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


def _standing(each: Standing) -> dict[str, Any]:
    found = dataclasses.asdict(each)
    found["rivals"] = [list(names) for names in each.rivals]
    return found


def _step(each: Step) -> dict[str, Any]:
    return {**_gain(each.chosen), "rivals": [_gain(rival) for rival in each.rivals]}


def _gain(gain: Gain) -> dict[str, Any]:
    return {
        "name": gain.text,
        "effects": list(gain.term.names),
        "gain": gain.share,
        "parameters": len(gain.term.columns),
    }
