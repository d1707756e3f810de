"""Draws effects that leave a residual of a given size."""

import dataclasses
from collections.abc import Callable

import numpy as np

from drake_disasm.effects import Effect, amplitudes, shape_parameters

_FIRST = 1e-3  # of a field's range, where the search for its value starts
_MOST_FIELDS = 2
_ROUNDS = 6  # to come close; more only to reach the given size at all
_MOST_ROUNDS = 15
_ATTEMPTS = 4
_MOST_OF_RANGE = 0.9
_ENOUGH = 0.5  # of the given size
_CLOSE = 0.05  # of the given size


def random_effect(
    kind: type[Effect],
    random: np.random.Generator,
    level: float,
    residual: Callable[[Effect], float],
) -> Effect:
    """Returns an effect that leaves a residual of about a given size.

    One or two of its amplitudes, of random signs where both are allowed, with shape
    parameters drawn within their grids' ranges.

    Args:
        kind: of effect.
        random: draws.
        level: rms of the residual, in units of the noise.
        residual: of a model without the effect on a log with it, without noise.
    """
    best, nearest = kind(), 0.0
    for _ in range(_ATTEMPTS):
        effect, found = _attempt(kind, random, level, residual)
        if found > nearest:
            best, nearest = effect, found
        if found >= _ENOUGH * level:
            break
    return best


def _attempt(
    kind: type[Effect],
    random: np.random.Generator,
    level: float,
    residual: Callable[[Effect], float],
) -> tuple[Effect, float]:
    """Returns an effect and the size of the residual that it leaves."""
    fields = {f.name: f.metadata for f in dataclasses.fields(kind)}
    names = amplitudes(kind)
    count = int(random.integers(1, min(_MOST_FIELDS, len(names)) + 1))
    unit = {}
    for name in random.choice(names, count, replace=False):
        reach = float(fields[name]["high"])
        sign = -1.0 if fields[name]["low"] < 0.0 and random.random() < 0.5 else 1.0
        unit[str(name)] = sign * reach * random.uniform(0.5, 1.0)
    look = {
        name: _between(min(grid), max(grid), random)
        for name, grid in shape_parameters(kind).items()
    }
    scale, before = _FIRST, None
    for number in range(1, _MOST_ROUNDS + 1):
        effect = kind(**look, **_within(fields, unit, scale))
        if effect == before:
            break  # its amplitudes are at their bounds
        found = residual(effect)
        if abs(found / level - 1.0) < _CLOSE:
            break
        if number >= _ROUNDS and found >= _ENOUGH * level:
            break
        # Contact sets in late and then steeply: never more than threefold at once.
        scale *= float(np.clip(level / max(found, 1e-9), 0.3, 3.0 if found else 10.0))
        before = effect
    return effect, found


def _between(low: float, high: float, random: np.random.Generator) -> float:
    """Returns a number between two, even on a logarithmic scale if both have one."""
    if low <= 0.0:
        return float(random.uniform(low, high))
    return float(np.exp(random.uniform(*np.log([low, high]))))


def _within(fields: dict, unit: dict[str, float], scale: float) -> dict[str, float]:
    """Returns amplitudes within their bounds; one at a bound would not be confirmed."""
    return {
        name: float(
            np.clip(
                scale * value,
                _MOST_OF_RANGE * fields[name]["low"],
                _MOST_OF_RANGE * fields[name]["high"],
            )
        )
        for name, value in unit.items()
    }
