"""Strict YAML: every key, shape and word is checked, and named when it is wrong.

Drake's own reader does the conversion. The checks before it are there for the message:
which key, in which line, and what to write instead.
"""

import dataclasses
import re
import typing
from collections.abc import Callable, Sequence
from typing import Any

import yaml
from pydrake.common.yaml import yaml_load_typed

from drake_disasm.common import bounded_yaml
from drake_disasm.common.errors import DisasmError
from drake_disasm.common.text import clipped
from drake_disasm.effects import find_effect, registered_effects
from drake_disasm.parts import find_part, registered_parts
from drake_disasm.scenario.names import remedy
from drake_disasm.scenario.schema import Range
from drake_disasm.scenario.tags import tagged

_MODEL = "see models/scenarios/removal.yaml"
_LINE = re.compile(r"^line \d+: ")
_MOST_ITEMS = 100  # effects, ranges
_LONGEST_WORD = 500  # characters: of a path, say
_LONGEST_NUMBER = 100
_NUMBERS: dict[type, Callable[[str], object]] = {int: int, float: float}


class _NodeError(DisasmError):
    """Something wrong at a node."""

    def __init__(self, node: yaml.Node, message: str) -> None:
        super().__init__(f"line {node.start_mark.line + 1}: {message}")


def parse(
    text: str,
    defaults: Any,
    source: str,
    *,
    path: str = "",
    line_numbers: bool = True,
) -> Any:
    """Returns `defaults`, a dataclass, overlaid with YAML text.

    Args:
        text: a YAML mapping.
        defaults: values of what the text leaves out.
        source: where the text is from, for messages.
        path: where the dataclass stands in a scenario, for messages.
        line_numbers: whether messages give lines; no for text that no file has.

    Raises:
        DisasmError: in one line, what is wrong and what to write instead.
    """
    try:
        _check(text, type(defaults), path)
        return yaml_load_typed(
            data=text, schema=tagged(type(defaults)), defaults=defaults
        )
    except DisasmError as error:
        message = str(error)
    except yaml.YAMLError as error:
        message = bounded_yaml.problem(error, text)
    except Exception as error:  # Drake's reader raises whatever comes
        reason = clipped(str(error) or type(error).__name__, 200)
        message = f"a value has the wrong shape ({reason}); {_MODEL}"
    if not line_numbers:
        message = _LINE.sub("", message, count=1)
    raise DisasmError(f"{source}: {message}")


def _check(text: str, schema: type, path: str) -> None:
    """Checks text against a dataclass.

    Raises:
        DisasmError: names the first key that is wrong.
        yaml.YAMLError: it is no YAML.
    """
    bounded_yaml.check_bounds(text)
    root = yaml.compose(text)
    if root is None:
        raise DisasmError(f"is empty; {_MODEL}")
    _check_section(root, schema, path)


def _check_section(node: yaml.Node, schema: type, path: str) -> None:
    """Checks a mapping that stands for a dataclass, and what is below it."""
    if not isinstance(node, yaml.MappingNode):
        here = f"{path}: is empty or not a section" if path else "is not a mapping"
        raise _NodeError(
            node, f"{here}; write key: value pairs below it, or leave it out"
        )
    fields = {field.name: field for field in dataclasses.fields(schema)}
    seen: set[str] = set()
    for key, value in node.value:
        name = key.value if isinstance(key, yaml.ScalarNode) else ""
        if name not in fields:
            raise _NodeError(key, _unknown(clipped(name), schema, path))
        if name in seen:
            raise _NodeError(key, f"key '{_join(path, name)}' is given twice; keep one")
        seen.add(name)
        _check_value(value, fields[name], _join(path, name))


def _check_value(node: yaml.Node, field: dataclasses.Field, path: str) -> None:
    if path == "part":
        _check_tagged(node, path, find_part, registered_parts())
    elif isinstance(field.type, type) and dataclasses.is_dataclass(field.type):
        _check_section(node, field.type, path)
    elif path == "effects":
        _check_effects(node)
    elif path == "randomisation":
        _check_ranges(node)
    elif typing.get_origin(field.type) is list:
        if not isinstance(node, yaml.SequenceNode):
            raise _NodeError(node, f"{path}: has the wrong shape; write [a, b, ...]")
        _check_length(node, path, field.metadata.get("length", _MOST_ITEMS))
        (kind,) = typing.get_args(field.type)
        for item in node.value:
            _check_scalar(item, kind, path, field.metadata)
    else:
        _check_scalar(node, typing.cast(type, field.type), path, field.metadata)


def _check_length(node: yaml.SequenceNode, path: str, most: int = _MOST_ITEMS) -> None:
    """Refuses a list that is too long, before each of its items is looked at."""
    count = len(node.value)
    if count > most:
        raise _NodeError(node, f"{path}: {count} values given, {most} needed at most")


def _check_scalar(node: yaml.Node, kind: type, path: str, metadata: Any) -> None:
    """Checks that a number or a word stands where one is meant."""
    unit = metadata.get("unit", "")
    wanted = f"a number in {unit}" if kind in _NUMBERS else "a word"
    if kind is int:
        wanted = "a whole number"
    if not isinstance(node, yaml.ScalarNode) or node.value == "":
        raise _NodeError(node, f"{path}: has the wrong shape; give {wanted}")
    longest = _LONGEST_NUMBER if kind in _NUMBERS else _LONGEST_WORD
    if len(node.value) > longest or not node.value.isprintable():
        raise _NodeError(
            node,
            f"{path}: '{clipped(node.value)}' is not printable, or longer than "
            f"{longest} characters; give {wanted}",
        )
    try:
        _NUMBERS.get(kind, str)(
            node.value.replace(".inf", "inf").replace(".nan", "nan")
        )
    except ValueError:
        raise _NodeError(
            node, f"{path}: '{clipped(node.value)}' is not a number; give {wanted}"
        ) from None


def _check_effects(node: yaml.Node) -> None:
    if not isinstance(node, yaml.SequenceNode):
        raise _NodeError(
            node, "effects: is not a list; write [] or lines of `- !Name {...}`"
        )
    _check_length(node, "effects")
    for number, item in enumerate(node.value):
        _check_tagged(item, f"effects.{number}", find_effect, registered_effects())


def _check_tagged(
    node: yaml.Node, path: str, find: Callable[[str], type], known: Sequence[type]
) -> None:
    """Checks a mapping whose tag names its class.

    Args:
        node: of the mapping.
        path: where it stands in a scenario.
        find: returns the class of a name.
        known: all of them, for the message.
    """
    if not node.tag.startswith("!"):
        names = ", ".join(kind.__name__ for kind in known)
        raise _NodeError(
            node, f"{path}: has no name; write `!Name {{...}}`, with one of {names}"
        )
    try:
        kind = find(clipped(node.tag.removeprefix("!")))
    except DisasmError as error:
        raise _NodeError(node, f"{path}: {error}") from None
    _check_section(node, kind, path)


def _check_ranges(node: yaml.Node) -> None:
    if not isinstance(node, yaml.SequenceNode):
        raise _NodeError(
            node,
            "randomisation: is not a list; write [] or lines of "
            "`- {parameter: effects.0.ry, low: -0.03, high: 0.03}`",
        )
    _check_length(node, "randomisation")
    for number, item in enumerate(node.value):
        _check_section(item, Range, f"randomisation.{number}")


def _unknown(name: str, schema: type, path: str) -> str:
    """Returns the message for an unknown key."""
    if not name:
        return f"{path or 'a key'}: a key must be a word; {_MODEL}"
    fields = [field.name for field in dataclasses.fields(schema)]
    place = f" in {path}" if path else ""
    return f"unknown key '{name}'{place}; {remedy(name, fields)}"


def _join(path: str, name: str) -> str:
    return f"{path}.{name}" if path else name
