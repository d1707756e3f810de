"""What joints remember of the path on which they came, along a log's motion."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drake_disasm.effects import JointMemoryEffect, amplitudes
from sysid.models.base import Array

_MOST_KEPT = 64  # memories: the shapes of a survey; those of a fit are of no more use


class PathMemory:
    """Memories of effects along all samples of a log, computed when asked for.

    Each episode begins without a memory. Whatever rows are fitted, the whole path
    counts.

    Args:
        joints: their names.
        episode: (n,) number of each sample's episode.
        q: (n, joints) positions.
    """

    def __init__(
        self, joints: Sequence[str], episode: NDArray[np.int64], q: Array
    ) -> None:
        self._joints, self._q = tuple(joints), q
        self._begins = np.flatnonzero(np.diff(episode, prepend=-1))
        self._known: dict[tuple[object, ...], Array] = {}

    def of(self, effect: JointMemoryEffect) -> Array:
        """Returns what an effect remembers at each sample (n,), in its shape."""
        key = _shape(effect)
        if key not in self._known:
            if len(self._known) >= _MOST_KEPT:
                self._known.pop(next(iter(self._known)))
            own = self._q[:, self._joints.index(effect.joint)]
            parts = np.split(own, self._begins[1:])
            self._known[key] = np.concatenate([effect.along(q) for q in parts])
        return self._known[key]


def _shape(effect: JointMemoryEffect) -> tuple[object, ...]:
    """Returns all that a memory depends on: the kind, and fields but amplitudes."""
    kind = type(effect)
    names = [f.name for f in dataclasses.fields(kind)]
    shape = [getattr(effect, n) for n in names if n not in amplitudes(kind)]
    return kind, *shape
