"""Which parts there are: the library's own and those that users add.

A part is added by the decorator `register_part`, wherever its class is defined; the
module must be imported by the program that uses it, or by `import_own` (`--import` on
the command line).
"""

import dataclasses
from typing import TypeVar

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.executors import import_in_workers
from drake_disasm.common.quantity import closest
from drake_disasm.common.user_code import import_named
from drake_disasm.effects import registered_effects
from drake_disasm.parts.base import Part

_Kind = TypeVar("_Kind", bound=type[Part])
_parts: dict[str, type[Part]] = {}


def register_part(part: _Kind) -> _Kind:
    """Adds a part to scenarios; a class decorator, above `@dataclasses.dataclass`.

    A class that is defined once more at the same place replaces the one before.

    Raises:
        DisasmError: not a complete part, or another one has its name.
    """
    name = getattr(part, "__name__", str(part))
    if not (isinstance(part, type) and issubclass(part, Part)):
        raise DisasmError(f"part {name}: is no class derived from Part")
    missing = ", ".join(sorted(part.__abstractmethods__))
    if missing:
        raise DisasmError(f"part {name}: lacks {missing}; define them")
    if "__dataclass_fields__" not in vars(part):
        raise DisasmError(f"part {name}: put @dataclasses.dataclass above the class")
    for field in dataclasses.fields(part):
        if "unit" not in field.metadata:
            raise DisasmError(f"part {name}: declare {field.name} by `quantity`")
    other = _parts.get(name)
    if other is not None and _place(other) != _place(part):
        raise DisasmError(
            f"part {name}: {_place(part)} has the same name as {_place(other)}; rename "
            "one of them"
        )
    _parts[name] = part
    if not part.__module__.startswith("drake_disasm."):
        import_in_workers(part.__module__)
    return part


def registered_parts() -> tuple[type[Part], ...]:
    """Returns all parts: the library's in the documentation's order, then others."""
    return tuple(_parts.values())


def find_part(name: str) -> type[Part]:
    """Returns the part of a name.

    Raises:
        DisasmError: there is none.
    """
    if name not in _parts:
        raise DisasmError(
            f"part '{name}' is not registered; {closest(name, list(_parts))} (a part "
            "of your own must be imported before it is used, by `imports`)"
        )
    return _parts[name]


def import_own(name: str) -> str:
    """Imports a module that registers parts or effects; so do worker processes.

    Args:
        name: of a module, or of a Python file, whose folder joins the search path.

    Returns:
        The name, so that it can be the type of a command line's argument.

    Raises:
        DisasmError: there is no such file or module, it fails, or it registers nothing.
    """
    before = {*registered_effects(), *registered_parts()}
    module = import_named(name, "effects or parts")
    known = {*registered_effects(), *registered_parts()}
    if known == before and module.__name__ not in {k.__module__ for k in known}:
        raise DisasmError(
            f"{name}: registers no effect or part; put @register_effect or "
            "@register_part above the class"
        )
    return name


def _place(part: type[Part]) -> str:
    return f"{part.__module__}.{part.__qualname__}"
