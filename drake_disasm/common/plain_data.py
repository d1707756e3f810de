"""Plain data from files: whether they have the form that the program gave them."""

from typing import Any

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.text import clipped, shown


def check_like(found: Any, example: Any, name: str = "") -> None:
    """Refuses plain data that are not formed as an example is.

    Args:
        found: what was read.
        example: a mapping whose keys there must be, with examples; a list whose one
            element, if it has one, all elements are like; a number or a text; or None
            for anything. A whole number counts as a float.
        name: of the data, for messages.

    Raises:
        DisasmError: names the first entry that is missing or of another type.
    """
    if example is None or (type(example) is float and type(found) is int):
        return
    if type(found) is not type(example):
        kind = type(example).__name__
        raise DisasmError(f"has {shown(found)} for {name or 'all'}, which is no {kind}")
    if isinstance(example, list) and example:
        for number, item in enumerate(found):
            check_like(item, example[0], f"{name}.{number}".lstrip("."))
    for key in example if isinstance(example, dict) else ():
        if key not in found:
            raise DisasmError(f"lacks '{clipped(f'{name}.{key}'.lstrip('.'))}'")
        check_like(found[key], example[key], f"{name}.{key}".lstrip("."))
