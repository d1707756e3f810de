"""The effects that were found, kind by kind, as rows of a table."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from sysid.effect_selection.effect_names import by_kind, effect_class, in_words
from sysid.effect_selection.verdict import ParameterValue, Verdict


@dataclass(frozen=True)
class FieldRow:
    """One field of a kind of effect, at each joint where that was found.

    Attributes:
        field: its name.
        meaning: with its axis, in words; empty if the class is not known.
        unit: SI; where joints differ, each value has its own.
        is_signed: whether it may be positive or negative.
        values: by joint; "" for an effect that acts at no joint.
    """

    field: str
    meaning: str
    unit: str
    is_signed: bool
    values: Mapping[str, ParameterValue]


@dataclass(frozen=True)
class KindRow:
    """One kind of effect.

    Attributes:
        name: of its class.
        words: what a sentence calls it.
        description, equation, place: of the class, if it is known; else empty.
        joints: where it was found; none for an effect that acts at no joint.
        shares: by joint, or by "": of the loss without it that it takes away.
        rows: one for each field that was fitted.
    """

    name: str
    words: str
    description: str
    equation: str
    place: str
    joints: tuple[str, ...]
    shares: Mapping[str, float]
    rows: tuple[FieldRow, ...]


def kind_rows(verdict: Verdict) -> list[KindRow]:
    """Returns the effects of a verdict, all joints of a kind together."""
    shares = dict(zip(verdict.names, verdict.gains, strict=True))
    found = []
    for kind, joints in by_kind(verdict.names).items():
        known = effect_class(kind)
        own = {joint: f"{kind}.{joint}" if joint else kind for joint in joints or ("",)}
        found.append(
            KindRow(
                kind,
                in_words(kind),
                known.description() if known else "",
                known.equation() if known else "",
                known.place() if known else "",
                joints,
                {joint: shares[name] for joint, name in own.items()},
                _field_rows(kind, own, verdict.values),
            )
        )
    return found


def _field_rows(
    kind: str, names: Mapping[str, str], values: Sequence[ParameterValue]
) -> tuple[FieldRow, ...]:
    """Returns the fields of a kind, in the order in which they were fitted.

    Args:
        kind: of effect.
        names: of the effects, by joint.
        values: of all parameters.
    """
    fields: dict[str, dict[str, ParameterValue]] = {}
    for joint, name in names.items():
        for value in values:
            head, _, field = value.name.rpartition(".")
            if head == name:
                fields.setdefault(field, {})[joint] = value
    return tuple(_field_row(kind, field, own) for field, own in fields.items())


def _field_row(kind: str, field: str, values: Mapping[str, ParameterValue]) -> FieldRow:
    known = effect_class(kind)
    data = known.__dataclass_fields__[field].metadata if known else {}
    units = list(dict.fromkeys(value.unit for value in values.values()))
    is_signed = data.get("low", 0.0) < 0.0 < data.get("high", 0.0)
    unit = " or ".join(units)
    return FieldRow(field, str(data.get("doc", "")), unit, is_signed, values)
