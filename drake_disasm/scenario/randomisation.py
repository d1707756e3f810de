"""Domain randomisation: ranges in a scenario, and one draw of them per episode."""

import copy
import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np

from drake_disasm.common.errors import DisasmError
from drake_disasm.scenario.names import find_field, find_number, resolve
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
    """Returns the scenario with numbers set, and nothing left to draw.

    Args:
        scenario: stays as it is.
        values: name (see `drake_disasm.scenario.names`) to value, in the field's own
            unit.

    Raises:
        DisasmError: a name leads nowhere.
    """
    drawn = _copied(scenario)
    drawn.randomisation = []
    for name, value in values.items():
        drawn, path = resolve(drawn, name)
        find_field(drawn, path, name).set(value)
    return drawn


def _copied(tree: Any) -> Any:
    """Returns a deep copy of dataclasses and lists of them, ten times as fast.

    An identification makes 10⁵.
    """
    if isinstance(tree, float | int | str):
        return tree
    if isinstance(tree, list):
        return [_copied(item) for item in tree]
    if dataclasses.is_dataclass(tree) and not isinstance(tree, type):
        new = object.__new__(type(tree))
        values = tree.__dict__.items()
        new.__dict__.update({name: _copied(value) for name, value in values})
        return new
    return copy.deepcopy(tree)


def corner(scenario: Scenario, end: str) -> Scenario:
    """Returns a scenario with all ranges at an end, "low" or "high"."""
    ranges = scenario.randomisation
    return with_values(scenario, {r.parameter: getattr(r, end) for r in ranges})


def refuse_broken_ranges(scenario: Scenario) -> None:
    """Checks that every range is of a number that is there, and given once.

    Raises:
        DisasmError: names the first that is not, and the remedy.
    """
    seen: dict[str, str] = {}
    for number, range_ in enumerate(scenario.randomisation):
        here, name = f"randomisation.{number}", range_.parameter
        try:
            scenario, path = resolve(scenario, name)
            find_number(scenario, path, name)
        except DisasmError as error:
            raise DisasmError(f"{here}: {error}") from None
        if range_.low > range_.high:
            raise DisasmError(
                f"{here}: low {range_.low:g} is above high {range_.high:g}; swap them"
            )
        if path in seen:
            other = "" if seen[path] == name else f" (as {seen[path]})"
            raise DisasmError(f"{here}: {name} is given twice{other}; keep one")
        seen[path] = name
