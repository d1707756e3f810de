"""The tags of effects and parts in YAML: `- !SensorBias {fx: 0.5}`."""

import dataclasses
import functools
import typing

from drake_disasm.effects import Effect, registered_effects
from drake_disasm.parts import Part, registered_parts
from drake_disasm.scenario.schema import Scenario


@dataclasses.dataclass
class _Untagged:
    """Stands first in a union, so that each of the others needs its `!Name` tag."""


def tagged(schema: type) -> type:
    """Returns the schema by which Drake reads and writes a dataclass.

    That of a scenario has the effects and parts that are registered now as tagged
    unions; any other dataclass is its own.
    """
    if schema is not Scenario:
        return schema
    return _with_unions(registered_effects(), registered_parts())


@functools.lru_cache(maxsize=1)
def _with_unions(
    effects: tuple[type[Effect], ...], parts: tuple[type[Part], ...]
) -> type:
    unions = {"effects": list[_union(effects)], "part": _union(parts)}  # type: ignore[misc]
    return dataclasses.make_dataclass(
        Scenario.__name__,
        [(f.name, unions.get(f.name, f.type)) for f in dataclasses.fields(Scenario)],
    )


def _union(kinds: typing.Sequence[type]) -> typing.Any:
    # Drake writes the first type that matches: classes stand before their bases.
    ordered = sorted(kinds, key=lambda kind: -len(kind.__mro__))
    return typing.Union[(_Untagged, *ordered)]
