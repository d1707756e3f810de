"""The effects of a scenario, in the order in which they act."""

from collections.abc import Sequence

import numpy as np

from drake_disasm.effects.base import (
    AT_REST,
    BoltMotion,
    Effect,
    Environment,
    EnvironmentEffect,
    MotionEffect,
    PoseEffect,
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


def pose_weights(effects: Sequence[Effect], period: float) -> np.ndarray:
    """Returns the weights (m,) of poses in the one that is reported, the newest first.

    Args:
        effects: of a scenario; those on the measured pose count.
        period: of the MDP [s].
    """
    weights = np.ones(1)
    for effect in effects:
        if isinstance(effect, PoseEffect) and not effect.is_null:
            weights = np.convolve(weights, effect.weights(period))
    return weights


def reported_poses(path: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Returns what is reported (n, 6) of an episode's poses (n, 6), from its start on.

    Before the first of them the bolt was there, too.
    """
    before = np.tile(path[0], (len(weights) - 1, 1))
    whole = np.vstack([before, path])
    ago = (whole[len(before) - i : len(whole) - i] for i in range(len(weights)))
    return np.sum([w * part for w, part in zip(weights, ago, strict=True)], axis=0)


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
