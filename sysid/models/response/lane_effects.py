"""Effects of many parameter sets, simulated side by side in lanes."""

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from drake_disasm.effects import ArmEffect, ArmTorqueEffect
from sysid.models.base import Array
from sysid.models.response.integrator import Lanes

Kind = TypeVar("Kind", bound=ArmEffect)


@dataclass(frozen=True)
class LaneEffect(Generic[Kind]):
    """An effect in neighbouring lanes.

    Attributes:
        effect: with fields (n,), one for each lane.
        lanes: which n.
    """

    effect: Kind
    lanes: slice

    @classmethod
    def of_sets(cls, alternatives: Sequence[Kind], segments: int, begin: int) -> Self:
        """Returns one of neighbouring sets from `begin` on, so many segments each."""
        effect = _with_numbers(
            alternatives[0],
            lambda name: np.repeat([getattr(e, name) for e in alternatives], segments),
        )
        first = begin * segments
        return cls(effect, slice(first, first + len(alternatives) * segments))

    def of(self, lanes: Lanes) -> tuple[Kind, slice]:
        """Returns the effect in some lanes, and which of those it acts in."""
        if isinstance(lanes, slice):
            return self.effect, self.lanes
        ends = np.searchsorted(lanes, [self.lanes.start, self.lanes.stop])
        own, effect = slice(*ends.tolist()), self.effect
        chosen = self.numbers(lanes[own])
        return _with_numbers(effect, lambda name: getattr(effect, name)[chosen]), own

    def numbers(self, lanes: NDArray[np.intp]) -> NDArray[np.intp]:
        """Returns which of the effect's own lanes some lanes are."""
        return np.asarray(lanes - self.lanes.start)


def _with_numbers(effect: Kind, of: Callable[[str], Array]) -> Kind:
    """Returns an effect with other numbers, by the names of its fields."""
    names = [f.name for f in dataclasses.fields(effect) if isinstance(f.default, float)]
    changed = {name: of(name) for name in names}
    return dataclasses.replace(effect, **changed)


def torques_in_lanes(
    sets: Sequence[tuple[ArmEffect, ...]], segments: int
) -> list[LaneEffect[ArmTorqueEffect]]:
    """Returns effects that are torques by the motion, see `in_lanes`."""
    torques = in_lanes(sets, segments, ArmTorqueEffect)  # type: ignore[type-abstract]
    return [effect for _, effect in torques]


def in_lanes(
    sets: Sequence[tuple[ArmEffect, ...]], segments: int, kind: type[Kind]
) -> list[tuple[list[Kind], LaneEffect[Kind]]]:
    """Returns the effects of all sets, in the lanes (sets segments,) where they act.

    Those of sets before the first in which an effect is not null, and after the last,
    are none of its.

    Args:
        sets: effects of each, the same classes in all.
        segments: how many lanes a set has.
        kind: of the effects that are wanted.

    Returns:
        Each effect as it is in the sets where it acts, and in their lanes.
    """
    found = []
    for alternatives in zip(*sets, strict=True):
        acts = np.flatnonzero([not effect.is_null for effect in alternatives])
        of_kind = [e for e in alternatives if isinstance(e, kind)]
        if of_kind and len(acts):
            first, end = int(acts[0]), int(acts[-1]) + 1
            acting = of_kind[first:end]
            found.append((acting, LaneEffect.of_sets(acting, segments, first)))
    return found
