"""Which effects there are: the library's own and those that users add.

An effect is added by the decorator `register_effect`, wherever its class is defined.
The module that defines it has to be imported: by the program that uses it, by
`drake_disasm.parts.import_own` (`--import` on the command line), or by itself, if its
package declares an entry point of the group `drake_disasm.effects`:

    [project.entry-points."drake_disasm.effects"]
    my_effects = "my_package.effects"
"""

import functools
from collections.abc import Callable
from importlib.metadata import entry_points
from typing import TypeVar, overload

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.executors import import_in_workers
from drake_disasm.common.quantity import closest
from drake_disasm.common.user_code import import_module
from drake_disasm.effects.base import Effect
from drake_disasm.effects.definition import refuse_faulty

_GROUP = "drake_disasm.effects"
_REMEDY = (
    "an effect of your own must be imported before it is used (`imports`), or be an "
    f"entry point of the group {_GROUP}"
)

_Kind = TypeVar("_Kind", bound=type[Effect])
_effects: dict[str, type[Effect]] = {}
_plugins_are_loaded = False


@overload
def register_effect(effect: _Kind, *, place: None = None) -> _Kind: ...
@overload
def register_effect(*, place: type[Effect]) -> Callable[[_Kind], _Kind]: ...
def register_effect(
    effect: _Kind | None = None, *, place: type[Effect] | None = None
) -> _Kind | Callable[[_Kind], _Kind]:
    """Adds an effect to YAML, simulation, identification and effect selection.

    A class decorator, above `@dataclasses.dataclass`. A class that is defined once
    more at the same place (a notebook's cell) replaces the one before.

    Args:
        effect: the class.
        place: where it acts, if that is a place of one's own: a class derived from
            Effect, which a model of logs names in its `effect_types`. Stations know
            nothing of it, and refuse such an effect by name.

    Raises:
        DisasmError: not a complete effect, or another one has its name.
    """
    if effect is None:
        return functools.partial(_register, place=place)
    return _register(effect, place)


def _register(effect: _Kind, place: type[Effect] | None) -> _Kind:
    refuse_faulty(effect, place)
    other = _effects.get(effect.__name__)
    if other is not None and _place(other) != _place(effect):
        raise DisasmError(
            f"effect {effect.__name__}: {_place(effect)} has the same name as "
            f"{_place(other)}; rename one of them"
        )
    _effects[effect.__name__] = effect
    if not effect.__module__.startswith("drake_disasm."):
        import_in_workers(effect.__module__)
    return effect


def registered_effects() -> tuple[type[Effect], ...]:
    """Returns all effects: the library's in the documentation's order, then others.

    Raises:
        DisasmError: the module of an entry point can't be imported.
    """
    _load_plugins()
    return tuple(_effects.values())


def find_effect(name: str) -> type[Effect]:
    """Returns the effect of a name.

    Raises:
        DisasmError: there is none; says how to register one.
    """
    _load_plugins()
    if name not in _effects:
        hint = closest(name, list(_effects))
        raise DisasmError(f"effect '{name}' is not registered; {hint} ({_REMEDY})")
    return _effects[name]


def _place(effect: type[Effect]) -> str:
    return f"{effect.__module__}.{effect.__qualname__}"


def _load_plugins() -> None:
    """Imports what entry points name, once."""
    global _plugins_are_loaded
    if _plugins_are_loaded:
        return
    _plugins_are_loaded = True  # a plugin may ask for the effects while it is imported
    try:
        for point in entry_points(group=_GROUP):
            package = point.dist.name if point.dist else "an unknown package"
            import_module(point.module, f"entry point {point.name} of {package}")
    except DisasmError:
        _plugins_are_loaded = False
        raise
