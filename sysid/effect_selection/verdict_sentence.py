"""A verdict in plain English: what is confirmed, what is not, and what is left.

The model lacks dry friction at six joints and an offset of the torque at four; with
them the held-out error falls from 6.7 % to 2.1 % of the torque. Suggested, not
confirmed: elasticity of a gear at joint_2.
"""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drake_disasm.common.prefixes import prefixed_unit
from sysid.effect_selection.channel_checks import ChannelFinding
from sysid.effect_selection.contradictions import Contradiction
from sysid.effect_selection.effect_names import (
    by_kind,
    effect_class,
    effects_in_words,
    enumeration,
    in_words,
)
from sysid.effect_selection.held_out import HeldOut
from sysid.effect_selection.left_over import LeftOver
from sysid.effect_selection.settings import DEFAULT_SETTINGS
from sysid.effect_selection.verdict import Verdict

_SHOWN = 3  # effects that a clause lists: a size of output, no threshold

_QUANTITIES = {"N": "force", "N m": "torque", "m": "position", "rad": "position"}


@dataclass(frozen=True)
class Rivals:
    """What a log can't tell from a kind of effect.

    Attributes:
        kinds: of other effects, or of several joined by "and".
        experiments: that would separate them.
    """

    kinds: tuple[str, ...]
    experiments: tuple[str, ...]


def verdict_sentence(verdict: Verdict, errors: HeldOut) -> str:
    """Returns a verdict in a sentence or two.

    Args:
        verdict: of a search.
        errors: on rows that were not fitted.
    """
    if verdict.written:
        rest = dataclasses.replace(verdict, written=())
        each = "; ".join(f"{w.what} ({w.remedy})" for w in verdict.written)
        return f"The log is not what it says: {each}. Put right: " + verdict_sentence(
            rest, errors
        )
    if verdict.misfits:
        rest = dataclasses.replace(verdict, misfits=())
        each = "; ".join(verdict.misfits)
        return f"Rows are not what the kind of the log says: {each}. As it is: " + (
            verdict_sentence(rest, errors)
        )
    if verdict.ending == "none":
        return f"{_nothing(verdict, errors)}."
    if verdict.ending == "too short":
        return _too_short(verdict)
    named = (*verdict.confirmed, *verdict.ambiguous)
    left = left_in_words(verdict)
    if not named:
        return _unexplained(verdict, errors, left)
    them = "it" if len(verdict.names) == 1 else "them"
    more = ""
    if verdict.suggested:
        more = f" Suggested, not confirmed: {effects_in_words(verdict.suggested)}."
        them = "these and what is suggested"
    but = f", but not all is explained: {left}" if left else ""
    improved = improvement_in_words(errors)
    lacks = f"The model lacks {effects_in_words(named)}"
    return f"{lacks}; with {them} {improved}{but}.{more}"


def _unexplained(verdict: Verdict, errors: HeldOut, left: str) -> str:
    """Returns that no effect is confirmed, and what is suggested."""
    why = f": {left}" if left else ""
    if not verdict.suggested:
        tried = "tried so far" if verdict.is_provisional else "of the library"
        return (
            f"The model lacks something that no effect {tried} explains{why}; "
            f"{_size_of_error(errors)} is left."
        )
    effects, improved = (
        effects_in_words(verdict.suggested),
        improvement_in_words(errors),
    )
    them = "it" if len(verdict.suggested) == 1 else "them"
    reasons = dict.fromkeys(x.reason for x in verdict.standings if x.reason)
    return (
        f"The model lacks something, and no effect is confirmed{why}. The log suggests "
        f"{effects}, with which {improved}; not confirmed, since {'; '.join(reasons)}. "
        f"A second recording could confirm {them}."
    )


def _too_short(verdict: Verdict) -> str:
    """Returns that the log could not have shown most effects, and what would."""
    hidden = verdict.undetectable
    kinds = by_kind([limit.effect for limit in verdict.limits])
    shown = [in_words(kind) for kind in list(hidden)[:_SHOWN]]
    more = f" and {len(hidden) - _SHOWN} more" if len(hidden) > _SHOWN else ""
    record = [text for text in dict.fromkeys(hidden.values()) if text][:_SHOWN]
    return (
        f"This log is too short to decide: nothing is missing that it shows, and "
        f"{len(hidden)} of {len(kinds)} kinds of effects would not have been found, "
        f"such as {enumeration(shown)}{more}; record: {'; '.join(record)}."
    )


def _nothing(verdict: Verdict, errors: HeldOut) -> str:
    """Returns that nothing is missing, and what would have been found."""
    if verdict.is_provisional:
        return "So far nothing was found that the model lacks"
    text = "This log shows nothing that the model lacks: the residual is noise"
    if errors.model_error is not None:
        text += " and what the model states of its own error"
    kinds = by_kind([limit.effect for limit in verdict.limits])
    seen = len(kinds) - len(verdict.undetectable)
    if not kinds:
        return text
    return (
        f"{text}, in which {seen} of {len(kinds)} kinds of effects would have been "
        "found if they were large enough"
    )


def _size_of_error(errors: HeldOut) -> str:
    """Returns the held-out error: "12 % of the torque", or "0.3 N"."""
    if errors.has_meaningful_share:
        unit = next(iter(errors.rms_by_unit(errors.after)))
        word = _QUANTITIES.get(unit, "readings")
        return f"{_two_digits(100.0 * errors.relative(errors.after))} % of the {word}"
    each = errors.rms_by_unit(errors.after)
    return enumeration([f"{rms:.2g} {unit}" for unit, rms in each.items()])


def indistinguishable_text(verdict: Verdict) -> str:
    """Returns which kinds of effects the log can't tell apart, in sentences."""
    which, sentences = single_strokes_text(verdict), []
    for kind, rivals in indistinguishable(verdict).items():
        others = enumeration([in_all_words(rival) for rival in rivals.kinds], "or")
        them = "the two" if len(rivals.kinds) == 1 else "them"
        sentences.append(
            f"This log{which} can't tell {in_words(kind)} from {others}; to separate "
            f"{them}, record: {'; '.join(rivals.experiments)}."
        )
    return " ".join(sentences)


def indistinguishable(verdict: Verdict) -> dict[str, Rivals]:
    """Returns the rivals of each kind of effect that has any."""
    found: dict[str, Rivals] = {}
    for name, ties in zip(verdict.names, verdict.ties, strict=True):
        if ties:
            kind = name.partition(".")[0]
            known = found.get(kind, Rivals((), ()))
            kinds = (*known.kinds, *(_kinds(tie.name) for tie in ties))
            parts = (part for tie in ties for part in tie.experiment.split("; "))
            told = (*known.experiments, *parts)
            found[kind] = Rivals(
                tuple(dict.fromkeys(kinds)), tuple(dict.fromkeys(told))
            )
    return found


def in_all_words(name: str) -> str:
    """Returns an effect, or several that are joined by "and", in words."""
    return " and ".join(in_words(part) for part in name.split(" and "))


def improvement_in_words(errors: HeldOut) -> str:
    """Returns how the held-out error changes: "the held-out error falls from ..."."""
    ends = (errors.before, errors.after)
    before, after = (errors.rms_by_unit(p) for p in ends)
    if errors.has_meaningful_share:
        word = _QUANTITIES.get(next(iter(before)), "readings")
        unit = f"% of the {word}"
        before, after = ({unit: 100.0 * errors.relative(p)} for p in ends)
        shown = [unit]
    else:
        telling = _telling(errors)
        shown = [unit for unit in before if unit in telling]
    changed = [u for u in shown if _two_digits(before[u]) != _two_digits(after[u])]
    texts = {u: _change(before[u], after[u], u) for u in changed}
    verbs = {
        "falls": [text for u, text in texts.items() if after[u] < before[u]],
        "rises": [text for u, text in texts.items() if after[u] > before[u]],
    }
    clauses = [f"{verb} {enumeration(each)}" for verb, each in verbs.items() if each]
    return f"the held-out error {' but '.join(clauses) or 'stays the same'}"


def _change(before: float, after: float, unit: str) -> str:
    """Returns "from 6.7 % to 2.1 % of the torque", or "from 0.3 to 0.1 N"."""
    if unit.startswith("%"):
        return f"from {_two_digits(before)} % to {_two_digits(after)} {unit}"
    factor, small = prefixed_unit(before, unit)
    return f"from {before / factor:.3g} to {after / factor:.3g} {small}"


def _telling(errors: HeldOut) -> set[str]:
    """Returns the units of channels above their noise, and the one that gains most."""
    before, after = (errors.in_sigma(p) ** 2 for p in (errors.before, errors.after))
    units = np.array([channel.unit for channel in errors.channels])
    gain = {unit: float((before - after)[units == unit].sum()) for unit in units}
    is_below = np.maximum(before, after) < 1.0
    return {*units[~is_below], max(gain, key=lambda unit: gain[unit])}


def left_in_words(verdict: Verdict) -> str:
    """Returns what is left, in a few words; empty if nothing is."""
    against = _contradictions(verdict.contradictions)
    excess = ""
    if verdict.excess and not against:
        excess = f"the residual is {verdict.excess:.2g} times the noise"
    clauses = (
        _correlated(verdict),
        against,
        excess,
        _findings(verdict.findings),
        _left_over(verdict.left_over),
        f"the model does not hold for this log: {verdict.invalid}"
        if verdict.invalid
        else "",
        _large_error(verdict),
    )
    return enumeration([clause for clause in clauses if clause])


def contradictions_text(found: Sequence[Contradiction]) -> str:
    """Returns which episodes contradict each other, in words; empty if none does."""
    if not found:
        return ""
    each = "; ".join(f"{' against '.join(c.episodes)} ({c.effect})" for c in found)
    return f"episodes that no common effect explains: {each}"


def _contradictions(found: Sequence[Contradiction]) -> str:
    texts = []
    for each in found:
        first, others = each.episodes[0], each.episodes[1:]
        kind = each.effect.partition("[")[0]
        why = in_all_words(kind) if effect_class(kind) else kind
        against = enumeration(others) or "the other episodes"
        texts.append(f"{first} contradicts {against} by {why}")
    return enumeration(texts)


def single_strokes_text(verdict: Verdict) -> str:
    """Returns a clause on joints that make a single stroke; empty if none does."""
    joints = verdict.single_strokes
    if not joints:
        return ""
    makes = "makes" if len(joints) == 1 else "make"
    return f", in which {enumeration(joints)} {makes} a single stroke,"


def _findings(found: Sequence[ChannelFinding]) -> str:
    """Returns what single channels show: what it is if that is known; else which."""
    said: dict[str, list[str]] = {}
    for each in found:
        if each.clause:
            said.setdefault(each.clause, []).append(each.channel)
    known = {channel for channels in said.values() for channel in channels}
    if len(said) > _SHOWN:
        said, known = {}, set()
    texts = [
        f"{enumeration(channels)} {clause if len(channels) == 1 else _of_many(clause)}"
        for clause, channels in said.items()
    ]
    rest = [c for c in dict.fromkeys(each.channel for each in found) if c not in known]
    if rest:
        texts.append(f"something is left in {enumeration(rest)}")
    return enumeration(texts)


def _of_many(clause: str) -> str:
    """Returns a clause behind several channels."""
    return clause.replace("has ", "have ", 1).replace("is ", "are ", 1)


def _left_over(found: Sequence[LeftOver]) -> str:
    """Returns what a flexible learner finds in what is left; empty for nothing."""
    if not found:
        return ""
    channels = enumeration([each.channel for each in found])
    causes = list(dict.fromkeys(each.depends_on[0] for each in found))
    most = max(each.share for each in found)
    share = f"{'up to ' * (len(found) > 1)}{_two_digits(100.0 * most)} %"
    return f"{share} of what is left in {channels} depends on {enumeration(causes)}"


def _correlated(verdict: Verdict) -> str:
    """Returns which channels are no white noise, if no effect is named."""
    channels = verdict.correlated
    if not channels or verdict.confirmed or verdict.ambiguous:
        return ""
    shown = enumeration(channels[:_SHOWN])
    shown += f" and {len(channels) - _SHOWN} more" * (len(channels) > _SHOWN)
    return f"the residual of {shown} is correlated from row to row"


def _large_error(verdict: Verdict) -> str:
    """Returns the share of the readings that is not predicted, if it is large."""
    share = verdict.relative_error
    if not share > DEFAULT_SETTINGS.max_relative_error:
        return ""
    return f"{_two_digits(100.0 * share)} % of what was measured is not predicted"


def _two_digits(value: float) -> str:
    return f"{float(f'{value:.2g}'):g}"


def _kinds(name: str) -> str:
    """Returns the effects of a tie without their joints."""
    parts = [part.partition(".")[0] for part in name.split(" and ")]
    return " and ".join(dict.fromkeys(parts))
