"""Which effects a station can carry; all others are refused by name."""

from collections.abc import Sequence

from drake_disasm.common.errors import DisasmError
from drake_disasm.effects import (
    ArmEffect,
    Effect,
    EnvironmentEffect,
    MotionEffect,
    PoseEffect,
    SensorEffect,
)

_KINDS = (EnvironmentEffect, MotionEffect, PoseEffect, SensorEffect, ArmEffect)


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
