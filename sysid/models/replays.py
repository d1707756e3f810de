"""Replays of the twin: one of each kind in a process, which all models share.

To build one takes half a second, to turn it into another scenario's some 20 ms; the
models of a search, one for each effect that is tried, differ in that alone.
"""

from drake_disasm.scenario import Scenario
from drake_disasm.task.impact_replay import ImpactReplay
from drake_disasm.task.replay import TwinReplay

#: By kind: a replay and its scenario's text, since who has a scenario may change it.
_built: dict[str, tuple[TwinReplay | ImpactReplay, str]] = {}


def impact_replay(scenario: Scenario, coarse: bool) -> ImpactReplay:
    """Returns the replay of many steps at once, at a scenario until the next call.

    Raises:
        DisasmError: the scenario is out of bounds.
        RuntimeError: its contact has no solution at A.
    """
    kind = f"impact, {coarse=}"
    replay = _reconfigured(kind, scenario)
    if not isinstance(replay, ImpactReplay):
        replay = ImpactReplay(scenario, coarse)
        _built[kind] = replay, repr(scenario)
    return replay


def twin_replay(scenario: Scenario) -> TwinReplay:
    """Returns the replay by Drake, at a scenario until the next call.

    Raises:
        DisasmError: the scenario is out of bounds.
        RuntimeError: its contact has no solution at A.
    """
    kind = f"twin, {scenario.contact.model}"
    replay = _reconfigured(kind, scenario)
    if not isinstance(replay, TwinReplay):
        replay = TwinReplay(scenario)
        _built[kind] = replay, repr(scenario)
    return replay


def _reconfigured(kind: str, scenario: Scenario) -> TwinReplay | ImpactReplay | None:
    """Returns what has been built of a kind, at a scenario."""
    if kind not in _built:
        return None
    replay, present = _built[kind]
    if present != repr(scenario):
        del _built[kind]  # what fails on the way is in no state to be used again
        replay.reconfigure(scenario)
        _built[kind] = replay, repr(scenario)
    return replay
