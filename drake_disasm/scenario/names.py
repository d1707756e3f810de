"""The names of a scenario's fields, as all programs and files write them.

    part.clearance                      a field of a section
    gripper.stiffness.0                    an element of a list, counted from 0
    effects.0.ry                        a field of an effect, by its place in the list
    GroovePose.ry                       the same by the effect's name
    JointCoulombFriction.iiwa_joint_4.size      and by its joint

A scenario that lists no effect of a name gets it, at null, when the name is resolved:
`--set GroovePose.ry=0.02` adds a groove that is rotated.
"""

import dataclasses
import functools
import math
from collections.abc import Iterator, Mapping
from typing import Any

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.quantity import closest
from drake_disasm.effects import Effect, acts_at_joint, registered_effects
from drake_disasm.parts import registered_parts
from drake_disasm.scenario.schema import Scenario

_SECTIONS = frozenset(field.name for field in dataclasses.fields(Scenario))


@dataclasses.dataclass(frozen=True)
class Field:
    """Where a name leads in a scenario.

    Attributes:
        path: the name with effects by their numbers: `effects.0.ry`.
        owner: the section, effect or list that holds the value.
        key: name of the value in it, or its number in a list.
        metadata: unit, bounds and description; elements have their list's.
    """

    path: str
    owner: Any
    key: str | int
    metadata: Mapping[str, Any]

    @property
    def value(self) -> Any:
        """What the scenario has there."""
        if isinstance(self.key, int):
            return self.owner[self.key]
        return getattr(self.owner, self.key)

    def set(self, value: Any) -> None:
        """Changes the scenario; leaves checks to `validate`."""
        if isinstance(self.key, int):
            self.owner[self.key] = value
        else:
            setattr(self.owner, self.key, value)

    @property
    def can_vary(self) -> bool:
        """Whether it is a number with bounds."""
        bounded = math.isfinite(self.metadata.get("low", math.inf))
        return isinstance(self.value, float) and bounded


def resolve(scenario: Scenario, name: str) -> tuple[Scenario, str]:
    """Returns the path that a name stands for, and the scenario that has it.

    It is the scenario itself, or one with one more effect, at null. Whether the path
    leads somewhere is for `find_field` to say.

    Raises:
        DisasmError: the name fits several effects, or does not say at which joint.
    """
    word, _, rest = name.partition(".")
    if word in _SECTIONS:
        return scenario, name
    kinds = {effect.__name__: effect for effect in registered_effects()}
    if word not in kinds:
        return scenario, name
    kind, place = kinds[word], {}
    if acts_at_joint(kind) and "." in rest:
        place["joint"], _, rest = rest.partition(".")
    numbers = [i for i, e in enumerate(scenario.effects) if _is_at(e, kind, place)]
    if len(numbers) > 1:
        raise DisasmError(
            f"{name}: the scenario lists {word} {len(numbers)} times; write "
            f"effects.{numbers[0]}.{rest}"
        )
    if not numbers:
        scenario, numbers = _with_effect(scenario, kind, place, name)
    return scenario, f"effects.{numbers[0]}.{rest}"


def _is_at(effect: Effect, kind: type[Effect], place: Mapping[str, str]) -> bool:
    same_kind = type(effect).__name__ == kind.__name__
    return same_kind and all(getattr(effect, k) == v for k, v in place.items())


def _with_effect(
    scenario: Scenario, kind: type[Effect], place: Mapping[str, str], name: str
) -> tuple[Scenario, list[int]]:
    """Returns the scenario with one more effect, and its number."""
    if acts_at_joint(kind) and not place:
        field = name.partition(".")[2]
        raise DisasmError(
            f"{name}: does not say at which joint; write {kind.__name__}.JOINT.{field}"
        )
    effects = [*scenario.effects, kind(**place)]
    return dataclasses.replace(scenario, effects=effects), [len(effects) - 1]


def find_field(scenario: Scenario, path: str, name: str = "") -> Field:
    """Returns the field at a path.

    Args:
        scenario: that has it.
        path: as `resolve` returns it.
        name: what the user wrote, for messages.

    Raises:
        DisasmError: it leads nowhere; names the nearest known word.
    """
    first, *rest = path.split(".")
    field = _child(scenario, first, {}, path, name or path)
    for word in rest:
        field = _child(field.value, word, field.metadata, path, name or path)
    return field


def find_number(scenario: Scenario, path: str, name: str = "") -> Field:
    """Returns the field at a path, which is a number with bounds.

    Raises:
        DisasmError: it leads nowhere, or to something else than a number.
    """
    field = find_field(scenario, path, name)
    if not field.can_vary:
        raise DisasmError(
            f"{name or path}: is not a number that can vary; name one such as "
            "contact.friction, gripper.stiffness.0 or GroovePose.ry"
        )
    return field


def _child(
    owner: Any, word: str, metadata: Mapping[str, Any], path: str, name: str
) -> Field:
    """Returns the field that the next word of a path names."""
    if isinstance(owner, list):
        if word.isdecimal() and int(word) < len(owner):
            return Field(path, owner, int(word), metadata)
        what = "count from 0"
        if path.startswith("effects."):
            what = f"the scenario lists {len(owner)} effects, counted from 0"
        raise DisasmError(f"{name}: there is no number {word} of {len(owner)}; {what}")
    if not dataclasses.is_dataclass(owner):
        raise DisasmError(f"{name}: '{word}' is not part of a number or word")
    kind: type = type(owner)
    fields = _fields_by_name(kind)
    if word in fields:
        return Field(path, owner, word, fields[word].metadata)
    known = list(fields)
    if isinstance(owner, Scenario):
        known += [effect.__name__ for effect in registered_effects()]
    raise DisasmError(f"{name}: '{word}' does not exist; {remedy(word, known)}")


@functools.cache
def _fields_by_name(kind: type) -> dict[str, dataclasses.Field[Any]]:
    """Returns a dataclass's fields; looked up 10⁵ times in an identification."""
    return {field.name: field for field in dataclasses.fields(kind)}


def remedy(word: str, known: list[str]) -> str:
    """Returns what to write instead of a word, for messages.

    Args:
        word: that is not known here.
        known: words that are.
    """
    sections = dict.fromkeys(  # once each
        path.rpartition(".")[0]
        for path in _paths(Scenario)
        if path.endswith(f".{word}") and word
    )
    if sections:
        return f"it belongs to {' or '.join(sections)}"
    return closest(word, known)


def _paths(schema: type, path: str = "") -> Iterator[str]:
    """Yields the paths of all fields of sections."""
    for field in dataclasses.fields(schema):
        own = f"{path}.{field.name}" if path else field.name
        yield own
        kinds = registered_parts() if own == "part" else (field.type,)
        for kind in kinds:
            if isinstance(kind, type) and dataclasses.is_dataclass(kind):
                yield from _paths(kind, own)
