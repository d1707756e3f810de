"""The names of effects, such as `TorqueOffset.joint_1`, in words and by their kinds."""

from collections.abc import Sequence

from drake_disasm.effects import Effect, registered_effects
from drake_disasm.effects.base import name_in_words

_NUMBERS = (
    *("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine"),
    *("ten", "eleven", "twelve"),
)
_SHOWN = 2  # joints that a sentence names; more are counted


def effect_class(name: str) -> type[Effect] | None:
    """Returns the class of an effect, with or without its joint; None if unknown."""
    kind = name.partition(".")[0]
    known = {effect.__name__: effect for effect in registered_effects()}
    return known.get(kind)


def in_words(name: str) -> str:
    """Returns what a sentence calls an effect, whatever its joint: "dry friction"."""
    known = effect_class(name)
    return known.in_words() if known else name_in_words(name.partition(".")[0])


def by_kind(names: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """Returns the joints of each kind of effect, in the order of the names.

    Of one that acts at no joint there are none.
    """
    found: dict[str, tuple[str, ...]] = {}
    for name in names:
        kind, _, joint = name.partition(".")
        found[kind] = found.get(kind, ()) + ((joint,) if joint else ())
    return found


def effects_in_words(names: Sequence[str]) -> str:
    """Returns effects in words: "dry friction at six joints and rotor inertia"."""
    phrases, is_counted = [], False
    for kind, joints in by_kind(names).items():
        where = _place(joints, is_counted)
        phrases.append(f"{in_words(kind)}{f' at {where}' if where else ''}")
        is_counted = is_counted or len(joints) > _SHOWN
    return enumeration(phrases)


def enumeration(parts: Sequence[str], word: str = "and") -> str:
    """Returns "a, b and c"."""
    if len(parts) < 2:
        return "".join(parts)
    return f"{', '.join(parts[:-1])} {word} {parts[-1]}"


def number_in_words(number: int) -> str:
    """Returns a number as a word, if it is a small one."""
    return _NUMBERS[number] if number < len(_NUMBERS) else str(number)


def _place(joints: Sequence[str], is_counted: bool) -> str:
    """Returns where effects of one kind act; "four" after "six joints"."""
    if len(joints) <= _SHOWN:
        return enumeration(joints)
    return number_in_words(len(joints)) + ("" if is_counted else " joints")
