"""A verdict in words: a sentence, what is missing, its parameters, and the errors.

The model lacks friction in the groove; with it the held-out error falls from 5 % to 1 %
of the force.
missing: GrooveFriction (or GrooveBend). Not distinguishable from this log; to
separate them, record: ...
that is: GrooveFriction: Coulomb friction that the nominal coefficient does not ...
parameters: GrooveFriction.mu = 0.21 (0.2 to 0.22)
error on held-out data: 0.5 -> 0.1 N; 5 -> 1 % of the readings
"""

from sysid.effect_selection.channel_checks import findings_text
from sysid.effect_selection.effect_names import by_kind, effect_class
from sysid.effect_selection.held_out import HeldOut
from sysid.effect_selection.verdict import ParameterValue, Verdict
from sysid.effect_selection.verdict_sentence import (
    contradictions_text,
    indistinguishable,
    single_strokes_text,
    verdict_sentence,
)


def verdict_text(verdict: Verdict, errors: HeldOut, most: int) -> str:
    """Returns a verdict in a few lines.

    Args:
        verdict: of a search.
        errors: on rows that were not fitted.
        most: items of anything that are listed.
    """
    lines = [
        verdict_sentence(verdict, errors),
        _missing_line(verdict, most),
        _meaning_line(verdict),
        _parameter_line(verdict, most),
        f"error on held-out data: {improvement_text(errors)}",
    ]
    if verdict.residual_model is not None:
        lines.append(f"besides: {verdict.residual_model.text}")
    return "\n".join(line for line in lines if line)


def improvement_text(errors: HeldOut) -> str:
    """Returns the error before and after in words."""
    before, after = (errors.rms_by_unit(p) for p in (errors.before, errors.after))
    text = ", ".join(f"{before[u]:.3g} -> {after[u]:.3g} {u}" for u in before)
    if not errors.has_meaningful_share:
        return text
    relative = [errors.relative(p) for p in (errors.before, errors.after)]
    shares = f"{100 * relative[0]:.2g} -> {100 * relative[1]:.2g}"
    return f"{text}; {shares} % of the readings"


def _missing_line(verdict: Verdict, most: int) -> str:
    """Returns what is missing, or that nothing is, or that no effect explains it."""
    if verdict.ending in ("none", "too short"):
        return f"missing: none; {_limits_text(verdict)}"
    left, effects = _left_text(verdict), _effects_text(verdict, most)
    status = _status_text(verdict)
    if not (verdict.confirmed or verdict.ambiguous):
        nearest = f". Suggested: {effects}{status}" if effects else ""
        return f"No effect is confirmed: {left or 'see the report'}{nearest}"
    return f"missing: {effects}{status}" + (
        f". Left unexplained: {left}" if left else ""
    )


def _status_text(verdict: Verdict) -> str:
    """Returns where effects stand, if not all are confirmed."""
    counts = {
        "confirmed": len(verdict.confirmed),
        "ambiguous": len(verdict.ambiguous),
        "suggested": len(verdict.suggested),
    }
    shown = [f"{count} {status}" for status, count in counts.items() if count]
    return f" ({', '.join(shown)})"


def _effects_text(verdict: Verdict, most: int) -> str:
    """Returns the effects with their ties, and what to record to separate them."""
    rivals = indistinguishable(verdict)
    parts = []
    for kind, joints in by_kind(verdict.names).items():
        text = f"{kind} of {len(joints)} joints" if len(joints) > 1 else kind
        text = f"{kind}.{joints[0]}" if len(joints) == 1 else text
        names = rivals[kind].kinds if kind in rivals else ()
        more = [f"{len(names) - most} more"] if len(names) > most else []
        others = " or ".join([*names[:most], *more])
        parts.append(text + (f" (or {others})" if others else ""))
    text = ", then ".join(parts)
    tests = dict.fromkeys(test for each in rivals.values() for test in each.experiments)
    if tests:
        text += (
            f". Not distinguishable from this log{single_strokes_text(verdict)}"
            + ("" if verdict.single_strokes else ";")
            + " to separate them, record: "
            + "; ".join(list(tests)[:most])
        )
    return text


def _meaning_line(verdict: Verdict) -> str:
    """Returns what the effects' names mean; empty if there are none."""
    classes = {kind: effect_class(kind) for kind in by_kind(verdict.names)}
    meanings = [
        f"{kind}: {known.description()}" for kind, known in classes.items() if known
    ]
    return f"that is: {' '.join(meanings)}" if meanings else ""


def _left_text(verdict: Verdict) -> str:
    """Returns what the effects leave unexplained, in words; empty for nothing."""
    other = contradictions_text(verdict.contradictions)
    if verdict.excess and not other:
        other = f"the residual is {verdict.excess:.2g} times the noise"
    learned = "; ".join(each.text for each in verdict.left_over)
    findings = findings_text(verdict.findings)
    parts = (other, findings, learned)
    return "; ".join(part for part in parts if part)


def _limits_text(verdict: Verdict) -> str:
    """Returns what would have been found, in words."""
    kinds, hidden = by_kind([x.effect for x in verdict.limits]), verdict.undetectable
    if not kinds:
        return "the residual is consistent with noise"
    text = (
        f"{len(kinds) - len(hidden)} of {len(kinds)} kinds of effects would have been "
    )
    text += "found (from which amplitude on: result.json)"
    return text + (f", not {', '.join(hidden)}" if hidden else "")


def _parameter_line(verdict: Verdict, most: int) -> str:
    """Returns the parameters in the order of their effects.

    Of many effects, shape parameters are in the report only.
    """
    own = [
        value
        for name in verdict.names
        for value in verdict.values
        if value.name.startswith(f"{name}.")
    ]
    is_brief = len(verdict.names) > most
    shown = [
        _value_text(value)
        for value in own
        if value.excludes_null and not (is_brief and value.null is None)
    ]
    return "parameters: " + ("; ".join(shown) if shown else "none")


def _value_text(value: ParameterValue) -> str:
    """Returns a parameter's value and interval."""
    unit = "" if value.unit == "1" else f" {value.unit}"
    low, high = value.interval
    interval = f"{low:.4g} to {high:.4g}"
    bound = ", at its bound" if value.is_at_bound else ""
    return f"{value.name} = {value.value:.4g}{unit} ({interval}{bound})"
