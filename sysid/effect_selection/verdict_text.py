"""A verdict in words: what is missing, its parameters, and the error before and after.

missing: GrooveFriction (or GrooveBend). Not distinguishable from this log; to
separate them, record: ...
parameters: GrooveFriction.mu = 0.21 (0.2 to 0.22)
error on held-out data: 0.5 -> 0.1 N; 5 -> 1 % of the readings
"""

from collections.abc import Sequence

from sysid.effect_selection.channel_checks import findings_text
from sysid.effect_selection.contradictions import Contradiction
from sysid.effect_selection.held_out import HeldOut
from sysid.effect_selection.verdict import ParameterValue, Tie, Verdict


def verdict_text(verdict: Verdict, errors: HeldOut, most: int) -> str:
    """Returns a verdict in three lines, and one more where a model was learned.

    Args:
        verdict: of a search.
        errors: on rows that were not fitted.
        most: items of anything that are listed.
    """
    lines = [
        _missing_line(verdict, most),
        _parameter_line(verdict, most),
        f"error on held-out data: {improvement_text(errors)}",
    ]
    if verdict.residual_model is not None:
        lines.append(f"besides: {verdict.residual_model.text}")
    return "\n".join(lines)


def improvement_text(errors: HeldOut) -> str:
    """Returns the error before and after in words."""
    before, after = (errors.rms_by_unit(p) for p in (errors.before, errors.after))
    parts = [f"{before[unit]:.3g} -> {after[unit]:.3g} {unit}" for unit in before]
    relative = [errors.relative(p) for p in (errors.before, errors.after)]
    return (
        ", ".join(parts)
        + f"; {100 * relative[0]:.2g} -> {100 * relative[1]:.2g} % of the readings"
    )


def contradictions_text(found: Sequence[Contradiction]) -> str:
    """Returns which episodes contradict each other, in words; empty if none does."""
    if not found:
        return ""
    each = "; ".join(f"{' against '.join(c.episodes)} ({c.effect})" for c in found)
    return f"episodes that no common effect explains: {each}"


def _missing_line(verdict: Verdict, most: int) -> str:
    """Returns what is missing, or that nothing is, or that no effect explains it."""
    if verdict.ending == "none":
        return f"missing: none; {_limits_text(verdict)}"
    left, effects = _left_text(verdict), _effects_text(verdict, most)
    if verdict.ending == "unexplained":
        nearest = f". Nearest: {effects}" if effects else ""
        return f"No library effect explains the residual: {left}{nearest}"
    return f"missing: {effects}" + (f". Left unexplained: {left}" if left else "")


def _effects_text(verdict: Verdict, most: int) -> str:
    """Returns the effects with their ties, and what to record to separate them."""
    text = ", then ".join(
        name + (f" (or {_alternatives(name, ties, most)})" if ties else "")
        for name, ties in zip(verdict.names, verdict.ties, strict=True)
    )
    tests = dict.fromkeys(tie.experiment for each in verdict.ties for tie in each)
    if tests:
        text += (
            ". Not distinguishable from this log; to separate them, record: "
            + " / ".join(list(tests)[:most])
        )
    return text


def _left_text(verdict: Verdict) -> str:
    """Returns what the effects leave unexplained, in words; empty for nothing."""
    other = contradictions_text(verdict.contradictions)
    if verdict.excess and not other:
        other = f"the residual is {verdict.excess:.2g} times the noise"
    learned = "; ".join(each.text for each in verdict.left_over)
    parts = (verdict.dependence, other, findings_text(verdict.findings), learned)
    return "; ".join(part for part in parts if part)


def _limits_text(verdict: Verdict) -> str:
    """Returns what would have been found, in words."""
    effects = list(dict.fromkeys(limit.effect for limit in verdict.limits))
    hidden = [
        effect
        for effect in effects
        if all(x.amplitude is None for x in verdict.limits if x.effect == effect)
    ]
    text = "the residual is consistent with noise"
    if effects:
        text += (
            f"; {len(effects) - len(hidden)} of {len(effects)} effects would have been "
            "found (from which amplitude on: result.json)"
        )
    return text + (f", not {', '.join(hidden)}" if hidden else "")


def _alternatives(name: str, ties: Sequence[Tie], most: int) -> str:
    """Returns the other effects of a tie, without the joint if it is the same."""
    joint = name.partition(".")[2]
    names = [tie.name.removesuffix(f".{joint}") for tie in ties]
    more = [f"{len(names) - most} more"] if len(names) > most else []
    return " or ".join([*names[:most], *more])


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
    return f"{value.name} = {value.value:.4g}{unit} ({low:.4g} to {high:.4g})"
