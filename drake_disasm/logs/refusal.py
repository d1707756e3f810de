"""The one form of every refusal: file, what is wrong, remedy."""

from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.text import clipped

_LONGEST = 300  # characters of what is wrong, and of the remedy


def refusal(where: str | Path, what: str, remedy: str) -> DisasmError:
    """The error `<where>: <what>; <remedy>`, on one line, ready to be raised."""
    what, remedy = clipped(what, _LONGEST), clipped(remedy, _LONGEST)
    return DisasmError(f"{' '.join(str(where).split())}: {what}; {remedy}")


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Returns "did you mean 'x'? " for the nearest known word, or an empty text."""
    names = {name.lower(): name for name in known}
    near = get_close_matches(clipped(word).lower(), list(names), n=1)
    return f"did you mean '{names[near[0]]}'? " if near else ""


def quoted(names: Iterable[str]) -> str:
    """The names in quotes, separated by commas."""
    return ", ".join(f"'{name}'" for name in names)
