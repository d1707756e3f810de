"""A verdict in plain English: one sentence, and one on what a log can't tell apart.

The model lacks dry friction at six joints and an offset of the torque at four; with
them the held-out error falls from 6.7 % to 2.1 % of the torque.

Whatever a verdict has to say of what is left is a clause in `left_in_words`.
"""

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
from sysid.effect_selection.verdict import Undecided, Verdict

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
    """Returns a verdict as one sentence.

    Args:
        verdict: of a search.
        errors: on rows that were not fitted.
    """
    if verdict.ending == "none":
        return f"{_nothing(verdict, errors)}."
    effects, improved = effects_in_words(verdict.names), improvement_in_words(errors)
    them = "it" if len(verdict.names) == 1 else "them"
    left = left_in_words(verdict)
    if verdict.ending == "unexplained":
        nearest = f"; the nearest is {effects}, with which {improved}"
        why = f", since {left}" if left else ""
        tried = "tried so far" if verdict.is_provisional else "of the library"
        text = f"The model lacks something that no effect {tried} explains{why}"
        return f"{text}{nearest if effects else ''}."
    rest = f", but not all is explained: {left}" if left else ""
    return f"The model lacks {effects}; with {them} {improved}{rest}."


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
        verdict.dependence,
        against,
        excess,
        _findings(verdict.findings),
        _left_over(verdict.left_over),
        undecided_text(verdict.undecided),
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


def undecided_text(found: Sequence[Undecided]) -> str:
    """Returns which more effects may be there; empty for none."""
    if not found:
        return ""
    kinds = [in_words(each.kind) for each in found[:_SHOWN]]
    more = " or more" if len(found) > _SHOWN else ""
    share = _two_digits(100.0 * found[0].gain)
    return (
        f"{share} % of what is left may be {enumeration(kinds, 'or')}{more}, for which "
        "this log is too short"
    )


def _nothing(verdict: Verdict, errors: HeldOut) -> str:
    """Returns that nothing is missing, and what would have been found."""
    if verdict.is_provisional:
        return "So far nothing was found that the model lacks"
    text = "This log shows nothing that the model lacks: the residual is noise"
    if errors.model_error is not None:
        text += " and what the model states of its own error"
    kinds = by_kind([limit.effect for limit in verdict.limits])
    seen = by_kind([x.effect for x in verdict.limits if x.amplitude is not None])
    if not kinds:
        return text
    return (
        f"{text}, in which {len(seen)} of {len(kinds)} kinds of effects would have "
        "been found if they were large enough"
    )


def _two_digits(value: float) -> str:
    return f"{float(f'{value:.2g}'):g}"


def _kinds(name: str) -> str:
    """Returns the effects of a tie without their joints."""
    parts = [part.partition(".")[0] for part in name.split(" and ")]
    return " and ".join(dict.fromkeys(parts))
