"""Effects that may be added to a model as plain data, and back."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

from drake_disasm.scenario import (
    Scenario,
    scenario_from_mapping,
    scenario_to_mapping,
)
from sysid.fitting.candidates import Candidate

_AT_ONCE = 50  # effects: a scenario has a limit, which candidates exceed


def mappings_of(effects: Sequence[Candidate]) -> list[dict[str, Any]]:
    """Returns candidates as plain data."""
    scenario = Scenario(effects=[each.effect for each in effects])
    plain = json.loads(json.dumps(scenario_to_mapping(scenario)["effects"]))
    return [
        {"effect": effect, "fields": list(each.fields)}
        for effect, each in zip(plain, effects, strict=True)
    ]


def candidates_of(raw: Sequence[Mapping[str, Any]]) -> tuple[Candidate, ...]:
    """Returns the candidates that plain data describe.

    Raises:
        DisasmError: one is of no registered effect.
    """
    effects: list[Any] = []
    for begin in range(0, len(raw), _AT_ONCE):
        part = [each["effect"] for each in raw[begin : begin + _AT_ONCE]]
        effects += scenario_from_mapping({"effects": part}).effects
    return tuple(
        Candidate.of(effect).only(tuple(each["fields"]))
        for effect, each in zip(effects, raw, strict=True)
    )
