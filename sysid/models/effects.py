"""Effects on a model: where they may act, and their fields as parameters."""

import dataclasses
import itertools
import math
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_disasm.effects import ArmEffect, Effect, Reach
from sysid.parameters import Parameter

_UNKNOWN = Reach()
_RESTS = 0.05  # of the greatest speed: noise of a filtered velocity is no motion
_NEXT_TO_NOTHING = 0.02  # of the rows that move


def at_null(
    kind: type[Effect], joints: Sequence[str], reach: Reach = _UNKNOWN
) -> list[Effect]:
    """Returns a class of effects at null, in every place and shape.

    Args:
        kind: an effect at a joint is made for each joint, any other once.
        joints: their names.
        reach: of the log.
    """
    make: Callable[..., Effect] = kind
    places = kind.places(joints)
    grids = kind.grids(reach)
    return [
        make(**place, **dict(zip(grids, shape, strict=True)))
        for place in places
        for shape in itertools.product(*grids.values())
    ]


def effect_parameter(
    effects: Sequence[Effect], number: int, field: str, name: str = ""
) -> Parameter:
    """Returns the parameter that stands for a field of an effect.

    Args:
        effects: of a model.
        number: of the effect, from 0.
        field: of the effect.
        name: of the parameter; by default its path.
    """
    effect: Any = effects[number]
    path = f"effects.{number}.{field}"
    (found,) = (f for f in dataclasses.fields(effect) if f.name == field)
    return Parameter.of_field(
        name or path, path, getattr(effect, field), found.metadata
    )


def field_of(parameter: Parameter) -> str:
    """Returns the field of an effect that a parameter stands for; empty if of none."""
    head, _, rest = parameter.path.partition(".")
    return rest.partition(".")[2] if head == "effects" else ""


def with_fields(
    effects: Sequence[Effect], values: Mapping[str, float]
) -> tuple[Effect, ...]:
    """Returns effects with fields set, by their paths: `effects.0.size`."""
    found: list[Any] = list(effects)
    for path, value in values.items():
        _, number, field = path.split(".")
        found[int(number)] = dataclasses.replace(found[int(number)], **{field: value})
    return tuple(found)


def travel_of(joints: Sequence[str], q: NDArray[np.float64]) -> dict[str, float]:
    """Returns how far each joint moves in positions (n, joints), from end to end."""
    return dict(zip(joints, np.ptp(q, axis=0).tolist(), strict=True))


def one_way_joints(joints: Sequence[str], v: NDArray[np.float64]) -> tuple[str, ...]:
    """Returns the joints that move one way only.

    Args:
        joints: their names.
        v: (n, joints) velocities.
    """
    found = []
    for joint, own in zip(joints, v.T, strict=True):
        moving = own[np.abs(own) > _RESTS * np.abs(own).max(initial=0.0)]
        forth = float(np.mean(moving > 0.0)) if len(moving) else 0.0
        if min(forth, 1.0 - forth) < _NEXT_TO_NOTHING:
            found.append(joint)
    return tuple(found)


def is_shown(
    effect: Effect, travel: Mapping[str, float], one_way: Collection[str]
) -> bool:
    """Returns whether a motion can show an effect in its shape.

    Args:
        effect: at null.
        travel: of each joint, by name [rad or m]; none if the model has no joints.
        one_way: joints that move one way only.
    """
    if not isinstance(effect, ArmEffect):
        return True
    if effect.needs_both_ways and getattr(effect, "joint", "") in one_way:
        return False
    least = _least_shapes(effect, travel)
    return all(getattr(effect, name) >= value for name, value in least.items())


def within_reach(
    parameters: Sequence[Parameter],
    effects: Sequence[Effect],
    travel: Mapping[str, float],
    reach: Reach,
) -> list[Parameter]:
    """Returns fields of effects, their shapes bounded by what a log can show.

    Args:
        parameters: whose paths are `effects.0.size` and the like.
        effects: of the model.
        travel: of each joint, by name [rad or m].
        reach: of the log.
    """
    found = []
    for parameter in parameters:
        effect, field = effects[int(parameter.path.split(".")[1])], field_of(parameter)
        least = _least_shapes(effect, travel).get(field, -math.inf)
        most = effect.greatest_shapes(reach).get(field, math.inf)
        low = min(max(parameter.low, least), parameter.nominal)
        high = max(min(parameter.high, most), parameter.nominal)
        found.append(dataclasses.replace(parameter, low=low, high=high))
    return found


def _least_shapes(effect: Effect, travel: Mapping[str, float]) -> dict[str, float]:
    joint = getattr(effect, "joint", "")
    if not isinstance(effect, ArmEffect) or joint not in travel:
        return {}
    return effect.least_shapes(travel[joint])
