"""The names of effects, such as `TorqueOffset.joint_1`, in words and by their kinds."""

from collections.abc import Sequence

from drake_disasm.effects import Effect, registered_effects
from drake_disasm.effects.base import name_in_words

_SHOWN = 2  # joints that a sentence names; more are counted


def effect_class(name: str) -> type[Effect] | None:
    """Returns the class of an effect, with or without its joint; None if unknown."""
    kind = name.partition(".")[0]
    known = {effect.__name__: effect for effect in registered_effects()}
    return known.get(kind)


def in_words(name: str) -> str:
    """Returns what a sentence calls an effect, whatever its joint: "dry friction".

    Or several effects that are joined by "and".
    """
    kinds = [part.partition(".")[0] for part in name.split(" and ")]
    classes = [effect_class(kind) for kind in kinds]
    return " and ".join(
        known.in_words() if known else name_in_words(kind)
        for kind, known in zip(kinds, classes, strict=True)
    )


def by_kind(names: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Returns the joints of each kind of effect, in the order of the names.

    Of one that acts at no joint there are none.
    """
    found: dict[str, tuple[str, ...]] = {}
    for name in names:
        kind, _, joint = name.partition(".")
        found[kind] = found.get(kind, ()) + ((joint,) if joint else ())
    return found


def short_names(names: Sequence[str]) -> str:
    """Returns names, those of a kind at several joints as one, joined by "and"."""
    return " and ".join(
        f"{kind} of {len(joints)} joints"
        if len(joints) > 1
        else ".".join((kind, *joints))
        for kind, joints in by_kind(names).items()
    )


def effects_in_words(names: Sequence[str]) -> str:
    """Returns effects in words: "dry friction at 6 joints and rotor inertia"."""
    phrases = []
    for kind, joints in by_kind(names).items():
        is_many = len(joints) > _SHOWN
        where = f"{len(joints)} joints" if is_many else enumeration(joints)
        phrases.append(f"{in_words(kind)}{f' at {where}' if where else ''}")
    return enumeration(phrases)


def enumeration(parts: Sequence[str], word: str = "and") -> str:
    """Returns "a, b and c"."""
    if len(parts) < 2:
        return "".join(parts)
    return f"{', '.join(parts[:-1])} {word} {parts[-1]}"
