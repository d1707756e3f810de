"""The tags of effects in YAML: `- !SensorBias {fx: 0.5}`."""

import dataclasses
import functools
import typing

from drake_disasm.effects import Effect, registered_effects
from drake_disasm.scenario.schema import Scenario


@dataclasses.dataclass
class _Untagged(Effect):
    """Stands first in the union, so that every effect needs its `!Name` tag."""


def tagged(schema: type) -> type:
    """Returns the schema by which Drake reads and writes a dataclass.

    That of a scenario has the effects that are registered now as a tagged union; any
    other dataclass is its own.
    """
    return _with_union(registered_effects()) if schema is Scenario else schema


@functools.lru_cache(maxsize=1)
def _with_union(effects: tuple[type[Effect], ...]) -> type:
    # Drake writes the first type that matches: classes stand before their bases.
    kinds = sorted(effects, key=lambda effect: -len(effect.__mro__))
    union = typing.Union[(_Untagged, *kinds)]  # type: ignore[valid-type]
    return dataclasses.make_dataclass(
        Scenario.__name__,
        [
            (f.name, list[union] if f.name == "effects" else f.type)
            for f in dataclasses.fields(Scenario)
        ],
    )
