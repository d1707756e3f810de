"""Which effects a station, or a batch of twins, can carry; others are refused."""

import dataclasses
from collections.abc import Sequence

from pydrake.math import RigidTransform

from drake_disasm.common.errors import DisasmError
from drake_disasm.effects.base import (
    ArmEffect,
    Effect,
    Environment,
    EnvironmentEffect,
    MotionEffect,
    PoseEffect,
    SensorEffect,
)
from drake_disasm.effects.chains import environment_at

_KINDS = (EnvironmentEffect, MotionEffect, PoseEffect, SensorEffect, ArmEffect)
_OF_BOTH = frozenset(("X_GnG", "friction", "clearance", "force_Gn", "detent"))
#: The quantities of an Environment that a contact model has, by `contact.model`.
CONTACT_QUANTITIES = {
    "hydroelastic": _OF_BOTH | {"modulus", "head_modulus", "dissipation"},
    "impact": _OF_BOTH | {"impact_stiffness", "impact_exponent"},
}
_OTHER_CONTACT = {
    "hydroelastic": "set contact.model to impact, and use `station` twin",
    "impact": "set contact.model to hydroelastic",
}


def refuse_unknown_kinds(effects: Sequence[Effect]) -> None:
    """Refuses effects that act in no place that a simulated station has.

    Raises:
        DisasmError: names the first.
    """
    for effect in effects:
        if not isinstance(effect, _KINDS):
            kinds = ", ".join(kind.__name__ for kind in _KINDS)
            raise DisasmError(
                f"{type(effect).__name__}: acts in no place that a simulated station "
                f"has; derive it from one of {kinds}"
            )


def refuse_arm_effects(effects: Sequence[ArmEffect]) -> None:
    """Refuses effects on an arm, for a station without one.

    Raises:
        DisasmError: names the first.
    """
    if effects:
        raise DisasmError(
            f"{type(effects[0]).__name__}: acts on the arm, and the twin has none; "
            "take it out of effects, or use `station` cell"
        )


def refuse_on_hardware(effects: Sequence[Effect]) -> None:
    """Refuses effects: they act on a simulated plant; a real one has its own.

    Raises:
        DisasmError: names the first.
    """
    if effects:
        raise DisasmError(
            f"effects.0 (!{type(effects[0]).__name__}): acts on a simulated plant; "
            "hardware has its own effects; take it out of the scenario"
        )


def refuse_without_quantity(
    model: str, nominal: Environment, effects: Sequence[Effect]
) -> None:
    """Refuses effects on quantities that a contact model does not have.

    Args:
        model: the scenario's `contact.model`.
        nominal: the environment without effects.
        effects: any.

    Raises:
        DisasmError: names the first effect that would change nothing.
    """
    for effect in effects:
        if isinstance(effect, EnvironmentEffect):
            actual = environment_at(nominal, [effect])
            changed = environment_differences(nominal, actual)
            if changed and not changed & CONTACT_QUANTITIES[model]:
                raise DisasmError(
                    f"{type(effect).__name__}: changes {', '.join(sorted(changed))}, "
                    f"which {model} contact does not have; take it out of effects, or "
                    f"{_OTHER_CONTACT[model]}"
                )


def environment_differences(one: Environment, other: Environment) -> frozenset[str]:
    """Returns the names of the quantities in which environments differ."""
    return frozenset(
        field.name
        for field in dataclasses.fields(Environment)
        if not _same(getattr(one, field.name), getattr(other, field.name))
    )


def _same(one: object, other: object) -> bool:
    if isinstance(one, RigidTransform) and isinstance(other, RigidTransform):
        return one.IsExactlyEqualTo(other)
    return one == other
