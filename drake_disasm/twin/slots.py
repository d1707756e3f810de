"""Effects of many environments as few: a slot holds one effect of each environment.

The fields of a slot's effect are arrays with a row for each environment; where an
environment lacks the effect it is null there, and vanishes bit for bit.
"""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from drake_disasm.common.arrays import Array
from drake_disasm.effects import (
    Effect,
    EnvironmentEffect,
    MotionEffect,
    SensorEffect,
    is_local,
)
from drake_disasm.scenario import Scenario, corner

_PLACES: tuple[type[Effect], ...] = (EnvironmentEffect, MotionEffect, SensorEffect)


@dataclasses.dataclass(frozen=True)
class Slot:
    """A place for one effect of each environment.

    Attributes:
        kind: of the effect.
        fixed: its fields that are no numbers, by name: the same for all.
    """

    kind: type[Effect]
    fixed: tuple[tuple[str, Any], ...]

    @classmethod
    def of(cls, effect: Effect) -> "Slot":
        """Returns a slot that an effect fits."""
        numbers = _numbers(type(effect))
        fixed = tuple(
            (field.name, getattr(effect, field.name))
            for field in dataclasses.fields(effect)
            if field.name not in numbers
        )
        return cls(type(effect), fixed)

    @property
    def names(self) -> tuple[str, ...]:
        """Of the fields that are numbers."""
        return _numbers(self.kind)

    @property
    def null(self) -> list[float]:
        """The numbers of an effect that does nothing."""
        effect = self.kind(**dict(self.fixed))
        return [getattr(effect, name) for name in self.names]

    def effect(self, values: Array) -> Effect:
        """Returns the effect of n environments, of values (n, k) of its numbers."""
        numbers = {name: values[:, i] for i, name in enumerate(self.names)}
        return self.kind(**dict(self.fixed), **numbers)


@dataclasses.dataclass(frozen=True)
class BatchEffects:
    """The effects of n environments, in the order in which they act.

    Attributes:
        environment, motion, sensor: by place.
        is_local: whether some depend on the bolt's motion.
    """

    environment: tuple[EnvironmentEffect, ...]
    motion: tuple[MotionEffect, ...]
    sensor: tuple[SensorEffect, ...]
    is_local: bool


class EffectSlots:
    """The slots of a batch, and where each environment's effects are in them.

    Args:
        scenarios: one for each environment, with their ranges.
    """

    def __init__(self, scenarios: Sequence[Scenario]) -> None:
        self.slots: list[Slot] = []
        known: dict[str, list[tuple[int, Slot]]] = {}
        chains = []
        for scenario in scenarios:
            text = repr((scenario.effects, scenario.randomisation))
            if text not in known:
                known[text] = _chain(scenario)
                self._make_room([slot for _, slot in known[text]])
            chains.append(known[text])
        found = {id(chain): self._places(chain) for chain in chains}
        self._of_environment = [found[id(chain)] for chain in chains]
        sizes = [len(slot.names) for slot in self.slots]
        self._ends = np.cumsum([0, *sizes])

    @property
    def size(self) -> int:
        """How many numbers an environment's effects have."""
        return int(self._ends[-1])

    def count(self, place: type[Effect]) -> int:
        """Returns how many slots act in a place."""
        return sum(issubclass(slot.kind, place) for slot in self.slots)

    def row(self, environment: int, effects: Sequence[Effect]) -> np.ndarray:
        """Returns the numbers (size,) of an environment's effects.

        Args:
            environment: its number.
            effects: of its scenario, with ranges drawn.
        """
        row = np.concatenate([np.zeros(0), *(slot.null for slot in self.slots)])
        for number, place in self._of_environment[environment].items():
            names, first = self.slots[place].names, self._ends[place]
            values = [getattr(effects[number], name) for name in names]
            row[first : first + len(names)] = values
        return row

    def effects(self, values: Array) -> BatchEffects:
        """Returns the effects of n environments, of their numbers (n, size)."""
        made = [
            slot.effect(values[:, first:end])
            for slot, first, end in zip(
                self.slots, self._ends[:-1], self._ends[1:], strict=True
            )
        ]
        environment = tuple(e for e in made if isinstance(e, EnvironmentEffect))
        return BatchEffects(
            environment,
            tuple(e for e in made if isinstance(e, MotionEffect)),
            tuple(e for e in made if isinstance(e, SensorEffect)),
            is_local(environment),
        )

    def _make_room(self, chain: Sequence[Slot]) -> None:
        """Adds slots so that a chain finds its own in the order in which it acts."""
        at = 0
        for slot in chain:
            if slot in self.slots[at:]:
                at = self.slots.index(slot, at) + 1
            else:
                self.slots.insert(at, slot)
                at += 1

    def _places(self, chain: Sequence[tuple[int, Slot]]) -> dict[int, int]:
        """Returns the slot of each of a chain's effects, by its number in the list."""
        places, at = {}, 0
        for number, slot in chain:
            places[number] = self.slots.index(slot, at)
            at = places[number] + 1
        return places


def _chain(scenario: Scenario) -> list[tuple[int, Slot]]:
    """Returns effects that may act, in their order, by their number in the list."""
    ends = [corner(scenario, end).effects for end in ("low", "high")]
    numbered = [
        (_order(low), number, Slot.of(low))
        for number, (low, high) in enumerate(zip(*ends, strict=True))
        if not (low.is_null and high.is_null)
    ]
    return [(number, slot) for _, number, slot in sorted(numbered, key=lambda n: n[:2])]


def _order(effect: Effect) -> tuple[int, int]:
    """Returns the place of an effect in the order of all: where it acts, and when."""
    for place, kind in enumerate(_PLACES):
        if isinstance(effect, kind):
            return place, getattr(effect, "stage", 0)
    return len(_PLACES), 0


def _numbers(kind: type[Effect]) -> tuple[str, ...]:
    """Returns the names of an effect's fields that are numbers."""
    fields = dataclasses.fields(kind)
    return tuple(field.name for field in fields if isinstance(field.default, float))
