"""Dataclass fields that know their unit and their bounds."""

import dataclasses
import difflib
import math
from collections.abc import Iterator
from typing import Any

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.text import clipped, shown


def quantity(
    default: Any,
    unit: str,
    doc: str,
    *,
    low: float = -math.inf,
    high: float = math.inf,
    choices: tuple[str, ...] = (),
    grid: tuple[float, ...] = (),
    step: float | None = None,
    any_length: bool = False,
) -> Any:
    """Returns a dataclass field holding a number, a list of numbers or a word.

    Args:
        default: the value, or a list of values.
        unit: SI unit ("1" for a pure number, "" for words and switches).
        doc: one line that says what it is.
        low, high: inclusive bounds, in `unit`, of each element.
        choices: the words allowed, for a word.
        grid: values from which a search may begin, where the default is not enough.
        step: by which a search first changes it, where a smaller one shows nothing of
            what it does; None leaves that to the search.
        any_length: whether a list may have another number of values than the default.
    """
    metadata = {"unit": unit, "doc": doc, "low": low, "high": high}
    metadata |= {"choices": choices, "grid": grid, "step": step}
    if isinstance(default, list):
        length = {} if any_length else {"length": len(default)}
        return dataclasses.field(
            default_factory=lambda: list(default), metadata=metadata | length
        )
    return dataclasses.field(default=default, metadata=metadata)


def check(config: Any, path: str = "") -> None:
    """Raises DisasmError naming the first field that breaks its own bounds."""
    for name, value, metadata in _leaves(config, path):
        _check_leaf(name, value, metadata)


def closest(word: str, words: list[str]) -> str:
    """Returns " Did you mean ...?" or a list of what is known, for messages."""
    match = difflib.get_close_matches(word, words, n=1)
    return f"did you mean '{match[0]}'?" if match else f"known: {', '.join(words)}"


def _leaves(config: Any, path: str) -> Iterator[tuple[str, Any, Any]]:
    for field in dataclasses.fields(config):
        name = f"{path}.{field.name}" if path else field.name
        value = getattr(config, field.name)
        if dataclasses.is_dataclass(value):
            yield from _leaves(value, name)
        elif _is_list_of_sections(field, value):
            for i, item in enumerate(value):
                yield from _leaves(item, f"{name}.{i}")
        else:
            yield name, value, field.metadata


def _is_list_of_sections(field: dataclasses.Field, value: Any) -> bool:
    if not isinstance(value, list) or "length" in field.metadata:
        return False
    return all(dataclasses.is_dataclass(item) for item in value)


def _check_leaf(name: str, value: Any, metadata: Any) -> None:
    if metadata.get("choices") and value not in metadata["choices"]:
        raise DisasmError(
            f"{name}: '{clipped(str(value))}' is not known; "
            f"use one of {metadata['choices']}"
        )
    values = value if isinstance(value, list) else [value]
    if "length" in metadata and len(values) != metadata["length"]:
        raise DisasmError(
            f"{name}: {len(values)} values given, {metadata['length']} needed"
        )
    for number in values:
        if isinstance(number, (int, float)) and not isinstance(number, bool):
            _check_number(name, number, metadata)


def _check_number(name: str, number: float, metadata: Any) -> None:
    low, high = metadata.get("low", -math.inf), metadata.get("high", math.inf)
    if low <= number <= high and abs(number) < math.inf:
        return
    unit = metadata.get("unit", "")
    given = f"{number:g}" if isinstance(number, float) else shown(number)
    value = given if unit in ("", "1") else f"{given} {unit}"
    raise DisasmError(
        f"{name}: {value} is out of range; give a value from {low:g} to {high:g}"
    )
