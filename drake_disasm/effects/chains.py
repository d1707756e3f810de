"""The effects of a scenario, in the order in which they act."""

from collections.abc import Sequence

from drake_disasm.effects.base import (
    AT_REST,
    BoltMotion,
    Effect,
    Environment,
    EnvironmentEffect,
    MotionEffect,
    SensorEffect,
)


def motion_chain(effects: Sequence[Effect]) -> tuple[MotionEffect, ...]:
    """Returns the effects on the motion in the order in which they act."""
    chosen = [
        effect
        for effect in effects
        if isinstance(effect, MotionEffect) and not effect.is_null
    ]
    return tuple(sorted(chosen, key=lambda effect: effect.stage))


def is_local(effects: Sequence[Effect]) -> bool:
    """Returns whether the environment depends on where the bolt is, or how fast."""
    return any(
        isinstance(effect, EnvironmentEffect) and effect.is_local and not effect.is_null
        for effect in effects
    )


def environment_at(
    nominal: Environment, effects: Sequence[Effect], bolt: BoltMotion = AT_REST
) -> Environment:
    """Returns the environment with the effects in it, in the scenario's order."""
    for effect in effects:
        if isinstance(effect, EnvironmentEffect) and not effect.is_null:
            nominal = effect.apply(nominal, bolt)
    return nominal


def sensor_chain(effects: Sequence[Effect]) -> tuple[SensorEffect, ...]:
    """Returns the sensor's effects in the order in which they act."""
    chosen = [
        effect
        for effect in effects
        if isinstance(effect, SensorEffect) and not effect.is_null
    ]
    return tuple(sorted(chosen, key=lambda effect: effect.stage))
