"""What a class needs to be an effect; says what is missing."""

import dataclasses
import inspect
import itertools
import math
import typing
from collections.abc import Iterator
from typing import Any

from drake_disasm.common.errors import DisasmError
from drake_disasm.effects.base import (
    ArmEffect,
    Effect,
    EnvironmentEffect,
    JointEffect,
    MotionEffect,
    PoseEffect,
    SensorEffect,
)
from drake_disasm.effects.fields import amplitudes

#: The bases of effects: each is a place where one can act.
PLACES: tuple[type[Effect], ...] = (
    EnvironmentEffect,
    MotionEffect,
    PoseEffect,
    SensorEffect,
    ArmEffect,
)
_BASES = (
    "EnvironmentEffect, MotionEffect, PoseEffect, SensorEffect or JointEffect, or give "
    "the base that says where it acts as `place`"
)


def refuse_faulty(effect: type[Effect], place: type[Effect] | None = None) -> None:
    """Checks that a class is complete as an effect.

    Args:
        effect: the class.
        place: a base of one's own that says where it acts, besides `PLACES`.

    Raises:
        DisasmError: names the class, what it lacks, and the remedy.
    """
    for fault in itertools.chain(_faults_of_place(place), _faults(effect, place)):
        raise DisasmError(f"effect {getattr(effect, '__name__', effect)}: {fault}")


def _faults_of_place(place: Any) -> Iterator[str]:
    """Yields what is wrong with a place of one's own."""
    if place is not None and not (
        isinstance(place, type) and issubclass(place, Effect) and place is not Effect
    ):
        yield "its `place` says not where it acts; give a class derived from Effect"


def _faults(effect: Any, place: type[Effect] | None) -> Iterator[str]:
    """Yields what is wrong with a class; each check relies on those before it."""
    places = PLACES if place is None else (place,)
    if not isinstance(effect, type) or not issubclass(effect, places):
        bases = _BASES if place is None else f"{place.__name__}, its `place`"
        yield f"is not an effect; derive the class from {bases}"
    if "__dataclass_fields__" not in vars(effect):
        yield (
            "is not a dataclass; put @dataclasses.dataclass between @register_effect "
            "and the class"
        )
    if inspect.isabstract(effect):
        lacking = ", ".join(sorted(effect.__abstractmethods__))
        yield f"has no {lacking}; define what its base class declares"
    _resolve_types(effect)
    for field in dataclasses.fields(effect):
        yield from _field_faults(field)
    if not amplitudes(effect):
        yield (
            "has no amplitude, so nothing says how large it is; add a field made by "
            "amplitude(unit, low, high, doc)"
        )
    if issubclass(effect, JointEffect) and not hasattr(effect, "joint"):
        yield "has no joint to act at; add a field `joint: str = joint_name()`"


def _resolve_types(effect: type[Effect]) -> None:
    """Replaces types that `from __future__ import annotations` left as text."""
    texts = [f for f in dataclasses.fields(effect) if isinstance(f.type, str)]
    hints = typing.get_type_hints(effect) if texts else {}
    for field in texts:
        field.type = hints[field.name]


def _field_faults(field: dataclasses.Field) -> Iterator[str]:
    """Yields what a field lacks: unit, bounds, or a default within them."""
    if field.type is str and isinstance(field.default, str):
        return
    metadata, default = field.metadata, field.default
    bounds = metadata.get("low", math.inf), metadata.get("high", math.inf)
    if (
        field.type is not float
        or not isinstance(default, float)
        or not metadata.get("unit")
        or not all(map(math.isfinite, bounds))
    ):
        yield (
            f"field '{field.name}' is not a number with unit and bounds; make it by "
            "amplitude(unit, low, high, doc) or shape_parameter(...), of type float"
        )
    elif not all(bounds[0] <= v <= bounds[1] for v in (default, *metadata["grid"])):
        yield (
            f"field '{field.name}': {default:g} or its grid is not within "
            f"{bounds[0]:g} to {bounds[1]:g}; widen the bounds"
        )
