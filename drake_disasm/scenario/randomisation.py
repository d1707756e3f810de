"""Domain randomisation: ranges in a scenario, and one draw of them per episode."""

import copy
import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.quantity import closest
from drake_disasm.scenario.schema import Scenario

_STREAM = 0x52414E44  # apart from those of sensor noise and imprecision


def draw(scenario: Scenario, seed: int) -> dict[str, float]:
    """Returns the value that each ranged parameter has in the episode of a seed.

    The numbers come from a stream of their own, so that noise is what it would be
    without ranges.
    """
    generator = np.random.default_rng([seed, _STREAM])
    return {
        range_.parameter: float(generator.uniform(range_.low, range_.high))
        for range_ in scenario.randomisation
    }


def with_values(scenario: Scenario, values: Mapping[str, float]) -> Scenario:
    """Returns the scenario with parameters set, and nothing left to draw.

    Args:
        scenario: stays as it is.
        values: path to value, in the parameter's own unit.
    """
    drawn = copy.deepcopy(scenario)
    drawn.randomisation = []
    for path, value in values.items():
        *parents, name = path.split(".")
        owner: Any = drawn
        for part in parents:
            owner = _child(owner, part, path)
        if isinstance(owner, list):
            owner[int(name)] = value
        else:
            setattr(owner, name, value)
    return drawn


def refuse_broken_ranges(scenario: Scenario) -> None:
    """Checks that every range is of a number that is there, and given once.

    Raises:
        DisasmError: names the first that is not, and the remedy.
    """
    seen: set[str] = set()
    for number, range_ in enumerate(scenario.randomisation):
        here = f"randomisation.{number}"
        value: Any = scenario
        for part in range_.parameter.split("."):
            value = _child(value, part, f"{here}: {range_.parameter}")
        if not isinstance(value, float):
            raise DisasmError(
                f"{here}: {range_.parameter} is no number that can vary; name one "
                "such as effects.0.ry or lock.clearance"
            )
        if range_.low > range_.high:
            raise DisasmError(
                f"{here}: low {range_.low:g} is above high {range_.high:g}; swap them"
            )
        if range_.parameter in seen:
            raise DisasmError(f"{here}: {range_.parameter} is given twice; keep one")
        seen.add(range_.parameter)


def _child(owner: Any, name: str, path: str) -> Any:
    """Returns what a path's next word names."""
    if isinstance(owner, list):
        if name.isdecimal() and int(name) < len(owner):
            return owner[int(name)]
        raise DisasmError(f"{path}: there is no number {name} of {len(owner)}")
    names = (
        [field.name for field in dataclasses.fields(owner)]
        if dataclasses.is_dataclass(owner)
        else []
    )
    if name not in names:
        raise DisasmError(f"{path}: '{name}' does not exist; {closest(name, names)}")
    return getattr(owner, name)
