"""What joints remember of their paths while they are simulated."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from drake_disasm.effects import ArmEffect, JointMemoryEffect
from sysid.models.base import Array
from sysid.models.response.integrator import Lanes
from sysid.models.response.lane_effects import LaneEffect, in_lanes
from sysid.models.response.segments import Segment


@dataclass
class _Memory:
    """Of one effect, in the lanes where it acts.

    Attributes:
        acting: the effect.
        joint: number of its joint.
        q: (own lanes,) where the step began.
        memory: (own lanes,) there.
    """

    acting: LaneEffect[JointMemoryEffect]
    joint: int
    q: Array
    memory: Array

    def add_torques(self, needed: Array, q: Array, lanes: Lanes) -> None:
        """See Memories."""
        effect, own = self.acting.of(lanes)
        before, memory = self.q, self.memory
        if not isinstance(lanes, slice):
            chosen = self.acting.numbers(lanes[own])
            before, memory = before[chosen], memory[chosen]
        memory = effect.remember(memory, q[..., own, self.joint] - before)
        needed[..., own, self.joint] += effect.torque(memory)

    def remember(self, q: Array) -> None:
        """See Memories."""
        now = q[self.acting.lanes, self.joint]
        self.memory = self.acting.effect.remember(self.memory, now - self.q)
        self.q = now


class Memories:
    """Of all effects. Within a step a joint is taken to move one way.

    Args:
        memories: of each effect, where segments begin.
    """

    def __init__(self, memories: Sequence[_Memory]) -> None:
        self._memories = memories

    @classmethod
    def of(
        cls,
        joints: tuple[str, ...],
        sets: Sequence[tuple[ArmEffect, ...]],
        segments: Sequence[Segment],
    ) -> Self:
        """Returns the memories as segments begin, by the path measured before.

        Args:
            joints: of the arm.
            sets: effects of each.
            segments: the same for each set.
        """
        memories = []
        kind = JointMemoryEffect
        for own, acting in in_lanes(sets, len(segments), kind):  # type: ignore[type-abstract]
            joint = joints.index(own[0].joint)
            q = np.tile([segment.q[joint] for segment in segments], len(own))
            memory = [_at_begin(e, joint, segments) for e in own]
            memories.append(_Memory(acting, joint, q, np.concatenate(memory)))
        return cls(memories)

    def add_torques(self, needed: Array, q: Array, lanes: Lanes) -> None:
        """Adds effects' torques to those that are needed (..., n, joints).

        Args:
            needed: to be added to.
            q: (..., n, joints) where the joints are, in a step.
            lanes: which n.
        """
        for memory in self._memories:
            memory.add_torques(needed, q, lanes)

    def remember(self, q: Array) -> None:
        """Takes notice of where joints (all lanes, joints or more) end a step."""
        for memory in self._memories:
            memory.remember(q)


def _at_begin(
    effect: JointMemoryEffect, joint: int, segments: Sequence[Segment]
) -> Array:
    """Returns what an effect remembers as segments begin (segments,)."""
    found, along = np.zeros(len(segments)), dict[int, Array]()
    for number, segment in enumerate(segments):
        if segment.path is None:
            continue
        time, q = segment.path
        if id(q) not in along:
            along[id(q)] = effect.along(q[:, joint])
        before = int(np.searchsorted(time, segment.start, side="right")) - 1
        if before >= 0:
            found[number] = along[id(q)][before]
    return found
