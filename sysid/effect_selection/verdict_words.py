"""A verdict in plain English: a few sentences, and a line for each kind of effect.

::

    The model lacks dry friction at 6 joints. It also lacks an offset of the torque at
    j2 or friction that depends on the direction. With these effects the held-out error
    falls from 6.7 to 2.1 % of the torque.
      JointCoulombFriction of 6 joints  confirmed  size = 3.1 N m (2.9 to 3.3) at j1
      TorqueOffset.j2                   ambiguous  or JointAsymmetricFriction
    to separate rivals, record: rests: an offset is there at rest
    held-out error by channel (1 episode that was not fitted): j1 1.2 -> 0.4 N m
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drake_disasm.common.prefixes import prefixed_unit
from sysid.effect_selection.contradictions import Contradiction
from sysid.effect_selection.effect_names import (
    by_kind,
    effects_in_words,
    enumeration,
    in_words,
    short_names,
)
from sysid.effect_selection.replication import Status
from sysid.effect_selection.verdict import ParameterValue, Verdict
from sysid.fitting.settings import DEFAULT_SETTINGS
from sysid.residuals.held_out import HeldOut

_SHOWN = 3  # items of anything that are listed: a size of output, no threshold
_QUANTITIES = {"N": "force", "N m": "torque", "m": "position", "rad": "position"}


@dataclass(frozen=True)
class _Subject:
    """What effects are in sentences: what a model lacks, or what has changed.

    Attributes:
        which: "(shows nothing) that the model lacks".
        are: before effects that are confirmed.
        also: before others.
        something: of a residual that no effect is confirmed for.
        unknown: the same, where none is suggested either.
    """

    which: str
    are: str
    also: str
    something: str
    unknown: str


_LACKS = _Subject(
    "that the model lacks",
    "The model lacks",
    "It also lacks",
    "The model lacks something, and no effect is confirmed.",
    "The model lacks something that no effect {tried} explains.",
)
_CHANGED = _Subject(
    "that has changed since the reference",
    "Changed since the reference:",
    "Also changed:",
    "Something seems to have changed since the reference, and no effect is confirmed.",
    "Nothing has changed since the reference that an effect {tried} explains.",
)


@dataclass(frozen=True)
class KindLine:
    """Effects of one kind and one standing.

    Attributes:
        names: of the effects.
        status: see `Standing`.
        values: of their parameters; those that exclude null, if an amplitude does.
        rivals: kinds, or several joined by "and", that explain about as much.
        experiments: that would separate them.
        reasons: why they are not confirmed.
    """

    names: tuple[str, ...]
    status: Status
    values: tuple[ParameterValue, ...]
    rivals: tuple[str, ...]
    experiments: tuple[str, ...]
    reasons: tuple[str, ...]

    @property
    def title(self) -> str:
        """The name of a single effect, else the kind and the number of joints."""
        return short_names(self.names)

    @property
    def words(self) -> str:
        """The effects, or what explains as much: "an offset at j1 or dry friction"."""
        own, count = effects_in_words(self.names), len(self.rivals)
        rivals = [in_words(rival) for rival in self.rivals]
        others = f"one of {count} rivals" if count > 1 else enumeration(rivals)
        return f"{own} or {others}" if others else own

    @property
    def details(self) -> str:
        """Values with 95 % intervals, rivals, and why it is not confirmed.

        Of several joints, without shape parameters: those are in the report.
        """
        fields: dict[str, list[str]] = {}
        is_one = len(self.names) == 1
        for each in self.values:
            if is_one or each.null is not None:
                name, _, field = each.name.rpartition(".")
                unit = "" if each.unit == "1" else f" {each.unit}"
                bound = ", at its bound" if each.is_at_bound else ""
                low, high = each.interval
                text = f"{each.value:.4g}{unit} ({low:.4g} to {high:.4g}{bound})"
                text += "" if is_one else f" at {name.partition('.')[2]}"
                fields.setdefault(field, []).append(text)
        said = [f"{field} = {', '.join(texts)}" for field, texts in fields.items()]
        if self.rivals:
            said.append(f"or {enumeration(_first(self.rivals), 'or')}")
        return "; ".join([*said, *self.reasons])


def kind_lines(verdict: Verdict) -> list[KindLine]:
    """Returns the effects of a verdict by standing and kind, confirmed ones first."""
    groups: dict[tuple[Status, str], list[int]] = {}
    for number, each in enumerate(verdict.standings):
        key = (each.status, each.name.partition(".")[0])
        groups.setdefault(key, []).append(number)
    lines = []
    for (status, _), numbers in groups.items():
        names = tuple(verdict.names[number] for number in numbers)
        values: list[ParameterValue] = []
        for name in names:
            own = [v for v in verdict.values if v.name.rpartition(".")[0] == name]
            is_clear = any(v.excludes_null for v in own if v.null is not None)
            values += [v for v in own if v.excludes_null or not is_clear]
        ties = [tie for number in numbers for tie in verdict.ties[number]]
        rivals = _once([_kinds(tie.name) for tie in ties])
        tests = _once([test for tie in ties for test in tie.experiment.split("; ")])
        reasons = _once([verdict.standings[number].reason for number in numbers])
        lines.append(KindLine(names, status, tuple(values), rivals, tests, reasons))
    return lines


def verdict_sentence(verdict: Verdict, errors: HeldOut) -> str:
    """Returns a verdict in a few sentences: names, what is left, and the error.

    Args:
        verdict: of a search.
        errors: on rows that were not fitted.
    """
    said = []
    if verdict.written:
        each = "; ".join(f"{w.what} ({w.remedy})" for w in verdict.written)
        said.append(f"The log is not what it says: {each}. Put right:")
    if verdict.misfits:
        each = "; ".join(verdict.misfits)
        said.append(f"Rows are not what the kind of the log says: {each}. As it is:")
    if verdict.ending in ("none", "too short"):
        return " ".join([*said, _nothing(verdict, errors)])
    said += named_effects(verdict)
    if left := "; ".join(_left(verdict)):
        said.append(f"Left unexplained: {left}.")
    these = "these effects" if len(verdict.names) > 1 else "this effect"
    subject = f"With {these} the" if verdict.names else "The"
    is_large = verdict.relative_error > DEFAULT_SETTINGS.max_relative_error
    large = ", which is large" if is_large else ""
    said.append(f"{subject} held-out error {error_in_words(errors)}{large}.")
    return " ".join(said)


def verdict_text(verdict: Verdict, errors: HeldOut) -> str:
    """Returns a verdict in lines: `verdict_sentence`, effects, what to record, errors.

    The errors are those of each channel. Arguments are as of `verdict_sentence`.
    """
    lines = [verdict_sentence(verdict, errors), *effect_lines(verdict)]
    if verdict.ending in ("none", "too short") and (hidden := verdict.undetectable):
        record = "; ".join(_once(list(hidden.values()))[:_SHOWN])
        lines.append(f"not detectable: {', '.join(hidden)}; record: {record}")
    ends = (errors.rms(predicted) for predicted in (errors.before, errors.after))
    changes = [
        f"{channel.name} {before:.3g} -> {after:.3g} {channel.unit}"
        for channel, before, after in zip(errors.channels, *ends, strict=True)
    ]
    lines.append(f"held-out error by channel ({errors.how}): {', '.join(changes)}")
    if verdict.residual_model is not None:
        lines.append(f"besides: {verdict.residual_model.text}")
    return "\n".join(lines)


def effect_lines(verdict: Verdict) -> list[str]:
    """Returns a line for each kind of effect, and what to record to separate rivals."""
    effects, lines = kind_lines(verdict), []
    width = max((len(each.title) for each in effects), default=0)
    for each in effects:
        line = f"  {each.title:<{width}}  {each.status}  {each.details}"
        lines.append(line.rstrip())
    tied = [each.experiments for each in effects if each.rivals]
    first = _once([tests[0] for tests in tied])  # of each, and more if they are few
    if tests := _once([*first, *(test for tests in tied for test in tests)]):
        record = "; ".join(tests[: max(len(first), _SHOWN)])
        lines.append(f"to separate rivals{_strokes(verdict)}, record: {record}")
    return lines


def not_told_apart(verdict: Verdict) -> str:
    """Returns which kinds of effects the log can't tell apart, in sentences."""
    log, sentences = f"This log{_strokes(verdict)}", []
    for each in kind_lines(verdict):
        if each.rivals:
            others = enumeration([in_words(rival) for rival in each.rivals], "or")
            which = f"{in_words(each.names[0])} from {others}; to separate them"
            record = "; ".join(each.experiments)
            sentences.append(f"{log} can't tell {which}, record: {record}.")
    return " ".join(_once(sentences))


def error_in_words(errors: HeldOut) -> str:
    """Returns how the held-out error changes: "falls from 6.7 to 2.1 % of the torque".

    As a share of the readings where that means something; else of each unit with a
    channel above its noise, and of the unit that gains most.
    """
    ends = (errors.before, errors.after)
    before, after = (errors.rms_by_unit(predicted) for predicted in ends)
    sizes: list[tuple[str, str, str]] = []
    if errors.has_meaningful_share:
        first, last = (_rounded(100.0 * errors.relative(p), 2) for p in ends)
        (quantity,) = (_QUANTITIES.get(unit, "readings") for unit in before)
        sizes = [(first, last, f"% of the {quantity}")]
    else:
        squares = [errors.in_sigma(predicted) ** 2 for predicted in ends]
        units = np.array([channel.unit for channel in errors.channels])
        gain = {u: float((squares[0] - squares[1])[units == u].sum()) for u in before}
        is_below = np.maximum(*squares) < 1.0  # never, where the noise is not known
        telling = {*units[~is_below], max(gain, key=lambda unit: gain[unit])}
        for unit in (unit for unit in before if unit in telling):
            factor, small = prefixed_unit(before[unit], unit)
            first, last = (_rounded(x[unit] / factor, 3) for x in (before, after))
            sizes.append((first, last, small))
    changes: dict[str, list[str]] = {"falls": [], "rises": []}
    for first, last, unit in sizes:
        if first != last:
            verb = "falls" if float(last) < float(first) else "rises"
            changes[verb].append(f"from {first} to {last} {unit}")
    said = [f"{verb} {enumeration(each)}" for verb, each in changes.items() if each]
    same = enumeration([f"{last} {unit}" for _, last, unit in sizes])
    return " but ".join(said) or f"is {same}"


def _nothing(verdict: Verdict, errors: HeldOut) -> str:
    """Returns that nothing is missing, and how much would have been found."""
    which = _subject(verdict).which
    if verdict.ending == "too short":
        text = f"This log is too short to decide: it shows nothing {which}"
    elif verdict.is_provisional:
        return f"So far nothing was found {which}."
    else:
        text = f"This log shows nothing {which}: the residual is noise"
        if errors.model_error is not None:
            text += " and what the model states of its own error"
    kinds = by_kind([limit.effect for limit in verdict.limits])
    seen = f"{len(kinds) - len(verdict.undetectable)} of {len(kinds)} kinds of effects"
    return f"{text}; {seen} would have been found if large." if kinds else f"{text}."


def named_effects(verdict: Verdict) -> list[str]:
    """Returns sentences of what is confirmed, of sets, and of what is suggested."""
    words: dict[str, list[str]] = {"confirmed": [], "ambiguous": [], "suggested": []}
    for each in kind_lines(verdict):
        words[each.status].append(each.words)
    confirmed, sets, suggested = words.values()
    subject = _subject(verdict)
    said = [f"{subject.are} {enumeration(confirmed)}."] if confirmed else []
    lacks = subject.also if confirmed else subject.are
    if len(sets) > 1:
        said.append(f"{lacks} one of each of these sets: {'; '.join(sets)}.")
    elif sets:
        said.append(f"{lacks} {sets[0]}.")
    tried = "tried so far" if verdict.is_provisional else "of the library"
    if suggested and not said:
        said = [subject.something]
    if suggested:
        which = enumeration(_first(suggested))
        said.append(f"Suggested, for a second recording to confirm: {which}.")
    return said or [subject.unknown.format(tried=tried)]


def _subject(verdict: Verdict) -> _Subject:
    return _CHANGED if verdict.is_of_changes else _LACKS


def contradiction_parts(found: Contradiction) -> tuple[str, str, str]:
    """Returns an episode, which others it contradicts, and by what, in words."""
    one, *others = found.episodes
    kind = in_words(found.effect.partition("[")[0])
    return one, enumeration(others) or "the other episodes", kind


def _left(verdict: Verdict) -> list[str]:
    """Returns what the effects leave, clause by clause."""
    clauses: list[str] = []
    if verdict.correlated and not (verdict.confirmed or verdict.ambiguous):
        channels = enumeration(_first(verdict.correlated))
        clauses.append(f"the residual of {channels} is correlated from row to row")
    clauses += [
        "{} contradicts {} by {}".format(*contradiction_parts(each))
        for each in verdict.contradictions
    ]
    if verdict.excess:
        clauses.append(f"the residual is {verdict.excess:.2g} times the noise")
    texts: dict[str, list[str]] = {}
    for each in verdict.findings:
        texts.setdefault(each.text.partition(" (")[0], []).append(each.channel)
    if len(texts) <= _SHOWN:
        clauses += [f"{enumeration(names)}: {text}" for text, names in texts.items()]
    else:
        names = _once([each.channel for each in verdict.findings])
        clauses.append(f"something in {enumeration(names)}")
    if learned := verdict.predictable_residual:
        share = "up to " * (len(learned) > 1)
        share += _rounded(100.0 * max(each.share for each in learned), 2)
        channels = enumeration([each.channel for each in learned])
        causes = enumeration(_once([each.depends_on[0] for each in learned]))
        clauses.append(f"{share} % of the residual of {channels} depends on {causes}")
    if verdict.invalid:
        clauses.append(f"the model does not hold for this log: {verdict.invalid}")
    return clauses


def _strokes(verdict: Verdict) -> str:
    """Returns, in brackets, which joints make a single stroke; empty if none does."""
    joints = verdict.single_strokes
    makes = "makes" if len(joints) == 1 else "make"
    return f" ({enumeration(joints)} {makes} a single stroke)" if joints else ""


def _kinds(name: str) -> str:
    """Returns the effects of a tie without their joints."""
    return " and ".join(_once([x.partition(".")[0] for x in name.split(" and ")]))


def _once(texts: Sequence[str]) -> tuple[str, ...]:
    """Returns texts without repetitions and empty ones."""
    return tuple(dict.fromkeys(filter(None, texts)))


def _first(items: Sequence[str]) -> list[str]:
    """Returns the first items, and how many more there are."""
    more = len(items) - _SHOWN
    return [*items[:_SHOWN], *([f"{more} more"] if more > 0 else [])]


def _rounded(value: float, digits: int) -> str:
    return f"{float(f'{value:.{digits}g}'):g}"
