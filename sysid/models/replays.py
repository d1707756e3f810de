"""Replays of the twin: one of each kind in a process, which all models share.

To build the diagram takes half a second, to turn it into another scenario's some 20 ms;
the models of a search, one for each effect that is tried, differ in that alone.
"""

import functools
from collections.abc import Sequence

import numpy as np

from drake_disasm.scenario import Scenario
from drake_disasm.task.impact_replay import ImpactReplay
from drake_disasm.task.replay import Steps, TwinReplay

#: By kind of contact: a replay and its scenario's text, since who has a scenario may
#: change it.
_built: dict[str, tuple[TwinReplay, str]] = {}


def twin_replay(scenario: Scenario) -> TwinReplay:
    """Returns the replay by Drake, at a scenario until the next call.

    Raises:
        DisasmError: the scenario is out of bounds.
        RuntimeError: its contact has no solution at A.
    """
    text, kind = repr(scenario), scenario.contact.model
    replay, present = _built.pop(kind, (None, ""))  # nothing half changed is kept
    if replay is None:
        replay = TwinReplay(scenario)
    elif present != text:
        replay.reconfigure(scenario)
    _built[kind] = replay, text
    return replay


class DiagramReplays:
    """The replay by Drake for some scenarios, one after the other; see ImpactReplay.

    Args:
        scenarios: of the twins.
        whole: whether consecutive steps of whole episodes are simulated, each from
            where the one before has led.
    """

    def __init__(self, scenarios: Sequence[Scenario], whole: bool = False) -> None:
        self._scenarios, self._whole = scenarios, whole

    @property
    def reading_at_zeroing(self) -> np.ndarray:
        """What each sensor read (k, 6) when it was zeroed, [f; tau] in S."""
        return np.array([twin_replay(s).reading_at_zeroing for s in self._scenarios])

    def transitions(self, steps: Sequence[Steps]) -> list[np.ndarray]:
        """Returns the states (n, 12) after the steps of each.

        Raises:
            DisasmError: a scenario is out of bounds.
            RuntimeError: Drake's contact solver did not converge.
        """
        return [
            self._after(twin_replay(scenario), own)
            for scenario, own in zip(self._scenarios, steps, strict=True)
        ]

    def _after(self, replay: TwinReplay, steps: Steps) -> np.ndarray:
        return replay.episode(steps) if self._whole else replay.transitions(steps)


def impact_replay(scenarios: Sequence[Scenario], coarse: bool) -> ImpactReplay:
    """Returns the replay of many steps of scenarios with IMPACT contact at once.

    Raises:
        DisasmError: a scenario is out of bounds.
    """
    return _impact_replay(_Asked(repr(scenarios), tuple(scenarios)), coarse)


class _Asked:
    """Scenarios, the same as others if their text is."""

    def __init__(self, text: str, scenarios: Sequence[Scenario]) -> None:
        self.text, self.scenarios = text, scenarios

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Asked) and self.text == other.text

    def __hash__(self) -> int:
        return hash(self.text)


@functools.lru_cache(maxsize=4)
def _impact_replay(asked: _Asked, coarse: bool) -> ImpactReplay:
    return ImpactReplay(asked.scenarios, coarse)
