"""YAML from files: size, depth and aliases are bounded before anything is built.

A few lines of aliases of aliases stand for millions of values, and a few thousand
brackets take seconds to nest; both are seen in the parser's events, which are read
one by one.
"""

import dataclasses
from collections.abc import Iterable
from typing import Any

import yaml

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.text import clipped

MOST_BYTES = 2**18  # of a file that people write
MOST_VALUES = 10_000  # aliases written out
MOST_DEPTH = 40
LONGEST_SCALAR = 10_000  # characters

_PARSER = yaml.CSafeLoader if yaml.__with_libyaml__ else yaml.SafeLoader


@dataclasses.dataclass
class _Open:
    """A list or mapping that has not ended yet; or, ended, what an alias stands for.

    Attributes:
        anchor: its name, or None.
        values: in it so far, itself included.
        depth: of what is in it.
    """

    anchor: str | None
    values: int = 1
    depth: int = 0


def check_bounds(text: str, most_values: int = MOST_VALUES) -> None:
    """Refuses YAML that is too large to be meant.

    Args:
        text: of the file.
        most_values: with aliases written out.

    Raises:
        DisasmError: one line with the line's number, without a file's name.
        yaml.YAMLError: it is no YAML.
    """
    events = yaml.parse(text, Loader=_PARSER)
    opened, named = [_Open(None)], dict[str, _Open]()
    for event in events:
        line = event.start_mark.line + 1 if event.start_mark else 1
        if isinstance(event, yaml.CollectionStartEvent):
            opened.append(_Open(event.anchor))
            _check_depth(len(opened) - 1, line)
            continue
        if isinstance(event, yaml.CollectionEndEvent):
            part = opened.pop()
        elif isinstance(event, yaml.AliasEvent):
            part = _meant(str(event.anchor), opened, named, line)
        elif isinstance(event, yaml.ScalarEvent):
            part = _scalar(event, line)
        else:
            continue
        if not isinstance(event, yaml.AliasEvent) and part.anchor:
            named[part.anchor] = part
        _add(opened, part, line, most_values)


def load(text: str, most_values: int = MOST_VALUES) -> Any:
    """Returns the plain data that YAML text holds.

    Args:
        text: of the file.
        most_values: with aliases written out.

    Raises:
        DisasmError: one line without a file's name: too large, or no YAML.
    """
    try:
        check_bounds(text, most_values)
        return yaml.load(text, Loader=_PARSER)
    except DisasmError:
        raise
    except Exception as error:  # a date like 2020-13-45 raises whatever comes
        raise DisasmError(f"{problem(error, text)}; correct it") from None


def problem(error: Exception, text: str) -> str:
    """Returns what is wrong with YAML text, by what a parser raised: line, reason."""
    mark = getattr(error, "problem_mark", None)
    lines = len(text.splitlines())  # an end that comes too early is behind the last
    line = f"line {min(mark.line + 1, lines)}: " if mark else ""
    reason = getattr(error, "problem", None) or str(error) or type(error).__name__
    return f"{line}not YAML ({clipped(str(reason))})"


def _add(opened: list[_Open], part: _Open, line: int, most: int) -> None:
    """Counts a value to the list or mapping that it stands in."""
    parent = opened[-1]
    parent.values += part.values
    parent.depth = max(parent.depth, part.depth + 1)
    _check_depth(len(opened) - 1 + part.depth, line)
    if sum(each.values for each in opened) > most:
        raise DisasmError(
            f"line {line}: more than {most} values, aliases written out; shorten it"
        )


def _check_depth(depth: int, line: int) -> None:
    if depth > MOST_DEPTH:
        raise DisasmError(f"line {line}: nested deeper than {MOST_DEPTH}; flatten it")


def _meant(
    anchor: str, opened: Iterable[_Open], named: dict[str, _Open], line: int
) -> _Open:
    """Returns what an alias stands for."""
    if any(each.anchor == anchor for each in opened):
        raise DisasmError(
            f"line {line}: alias '*{clipped(anchor)}' is within itself; write it out"
        )
    return named.get(anchor, _Open(None))  # an unknown one is the parser's to refuse


def _scalar(event: yaml.ScalarEvent, line: int) -> _Open:
    if len(event.value) > LONGEST_SCALAR:
        raise DisasmError(
            f"line {line}: a value of more than {LONGEST_SCALAR} characters; shorten it"
        )
    return _Open(event.anchor)
