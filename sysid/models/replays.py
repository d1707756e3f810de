"""Replays of the twin, which all models of a process share.

To build the diagram takes half a second, to turn it into another scenario's some 20 ms;
the models of a search, one for each effect that is tried, differ in that alone. And
many of them ask for the same simulation: what acts on the sensor's readings alone does
not change it.
"""

import dataclasses
import functools
import hashlib
import threading
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from drake_disasm.scenario import Scenario
from drake_disasm.task.diagram_replay import TwinReplay
from drake_disasm.twin.replay import ImpactReplay
from drake_disasm.twin.steps import Ends, Steps

_MOST_BYTES = 2**26  # of simulations that are kept


class Replayed(NamedTuple):
    """What a twin's replay gives.

    Attributes:
        states: (n, 12) after the steps; NaN where contact finds no balance.
        give: (n, 6) by how much the grip has given way then, in coordinates; zeros
            of whole episodes.
        reading_at_zeroing: (6,) of the sensor, [f; tau] in S.
    """

    states: np.ndarray
    give: np.ndarray
    reading_at_zeroing: np.ndarray


class DiagramReplays:
    """The replay of scenarios by Drake, one after the other, but what is known.

    Args:
        scenarios: of the k twins.
        whole: whether consecutive steps of whole episodes are simulated, each from
            where the one before has led.
    """

    def __init__(self, scenarios: Sequence[Scenario], whole: bool = False) -> None:
        self._scenarios, self._whole = scenarios, whole

    def transitions(self, steps: Sequence[Steps]) -> list[Replayed]:
        """Returns what the steps of each twin give.

        Raises:
            DisasmError: a scenario is out of bounds.
            RuntimeError: Drake's contact solver did not converge.
        """
        pairs = zip(self._scenarios, steps, strict=True)
        keys = [f"whole={self._whole} {s!r}{_digest(own)}" for s, own in pairs]
        return _remembered(
            keys,
            lambda new: [self._replayed(self._scenarios[i], steps[i]) for i in new],
        )

    def _replayed(self, scenario: Scenario, steps: Steps) -> Replayed:
        replay = twin_replay(scenario)
        if self._whole:
            ends = Ends(replay.episode(steps), np.zeros((len(steps), 6)))
        else:
            ends = replay.ends(steps)
        return Replayed(*ends, replay.reading_at_zeroing)


class ImpactReplays:
    """The replay of scenarios with IMPACT contact, all at once, but what is known.

    Args:
        scenarios: of the k twins.
    """

    def __init__(self, scenarios: Sequence[Scenario]) -> None:
        self._scenarios = scenarios
        self._texts = [repr(scenario) for scenario in scenarios]

    def transitions(self, steps: Sequence[Steps]) -> list[Replayed]:
        """Returns what the steps of each twin give.

        Raises:
            DisasmError: a scenario is out of bounds.
        """
        pairs = zip(self._texts, steps, strict=True)
        keys = [text + _digest(own) for text, own in pairs]
        return _remembered(keys, lambda new: self._replayed(new, steps))

    def _replayed(self, which: Sequence[int], steps: Sequence[Steps]) -> list[Replayed]:
        """Returns the replays of some of the twins."""
        asked = tuple(self._scenarios[i] for i in which)
        text = "".join(self._texts[i] for i in which)
        replay = _impact_replay(_Asked(text, asked))
        ends = replay.ends([steps[i] for i in which])
        pairs = zip(ends, replay.reading_at_zeroing, strict=True)
        return [Replayed(*each, zero) for each, zero in pairs]


def _remembered(
    keys: Sequence[str], replay: Callable[[Sequence[int]], Sequence[Replayed]]
) -> list[Replayed]:
    """Returns simulations by their keys; those that are not kept are made together.

    Args:
        keys: of each.
        replay: makes some of them, by their places.
    """
    found = {key: known for key in keys if (known := _kept.get(key))}
    new = {key: i for i, key in enumerate(keys) if key not in found}
    if new:
        for key, own in zip(new, replay(list(new.values())), strict=True):
            found[key] = own
            _kept.put(key, own)
    return [Replayed(*(part.copy() for part in found[key])) for key in keys]


class _Kept:
    """The last simulations, up to a size."""

    def __init__(self) -> None:
        self._found: dict[str, Replayed] = {}
        self._bytes, self._lock = 0, threading.Lock()

    def get(self, key: str) -> Replayed | None:
        """Returns a simulation, if it is there."""
        with self._lock:
            return self._found.get(key)

    def put(self, key: str, found: Replayed) -> None:
        """Keeps a simulation."""
        with self._lock:
            self._found[key] = found
            self._bytes += found.states.nbytes + found.give.nbytes
            while self._bytes > _MOST_BYTES:
                oldest = self._found.pop(next(iter(self._found)))
                self._bytes -= oldest.states.nbytes + oldest.give.nbytes


_kept = _Kept()

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


def _digest(steps: Steps) -> str:
    """Returns a text that only the same steps have."""
    found = hashlib.blake2b()
    for part in vars(steps).values():
        found.update(np.ascontiguousarray(part).data)
    return found.hexdigest()


@dataclasses.dataclass(frozen=True)
class _Asked:
    """Scenarios, the same as others if their text is."""

    text: str
    scenarios: tuple[Scenario, ...] = dataclasses.field(compare=False)


@functools.lru_cache(maxsize=4)
def _impact_replay(asked: _Asked) -> ImpactReplay:
    return ImpactReplay(asked.scenarios)
