"""Replays of the twin: one of each kind in a process, which all models share.

To build one takes half a second, to turn it into another scenario's some 20 ms; the
models of a search, one for each effect that is tried, differ in that alone.
"""

import functools
from collections.abc import Callable
from typing import Any, TypeVar

from drake_disasm.scenario import Scenario
from drake_disasm.task.impact_replay import ImpactReplay
from drake_disasm.task.replay import TwinReplay

_Replay = TypeVar("_Replay", TwinReplay, ImpactReplay)

#: By kind: a replay and its scenario's text, since who has a scenario may change it.
_built: dict[str, tuple[Any, str]] = {}


def impact_replay(scenario: Scenario, coarse: bool) -> ImpactReplay:
    """Returns the replay of many steps at once, at a scenario until the next call.

    Raises:
        DisasmError: the scenario is out of bounds.
        RuntimeError: its contact has no solution at A.
    """
    build = functools.partial(ImpactReplay, coarse=coarse)
    return _at(scenario, f"impact, {coarse=}", build)


def twin_replay(scenario: Scenario) -> TwinReplay:
    """Returns the replay by Drake, at a scenario until the next call.

    Raises:
        DisasmError: the scenario is out of bounds.
        RuntimeError: its contact has no solution at A.
    """
    return _at(scenario, f"twin, {scenario.contact.model}", TwinReplay)


def _at(scenario: Scenario, kind: str, build: Callable[[Scenario], _Replay]) -> _Replay:
    """Returns the replay of a kind at a scenario, built if there is none."""
    text = repr(scenario)
    replay, present = _built.pop(kind, (None, ""))  # nothing half changed is kept
    if replay is None:
        replay = build(scenario)
    elif present != text:
        replay.reconfigure(scenario)
    _built[kind] = replay, text
    return replay
