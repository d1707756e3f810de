"""Gears between motors and links: where one yields or has play, the two move apart.

Encoders are on the motors' side. Of such a joint the link is one more coordinate,
behind those of all motors:

    q - q_link = c load + b / 2 tanh(load / load_0),

with the load that the link's side of the rigid bodies needs (Spong 1987). Beyond load_0
a link stays at an end of its play.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from drake_disasm.effects import ArmEffect, JointBacklash, JointElasticity
from sysid.models.base import Array
from sysid.models.response.integrator import Lanes

#: Effects between motors and links.
ON_GEARS = (JointElasticity, JointBacklash)
_SOON = 1e-3  # s, for the rate of a load


@dataclass(frozen=True)
class Gears:
    """The gears of many lanes.

    Attributes:
        joints: how many.
        which: (e,) joints whose links have a coordinate of their own.
        compliance: c (lanes, e) [rad/(N m)].
        play: b (lanes, e) [rad].
        load_0: (lanes, e) [N m].
    """

    joints: int
    which: NDArray[np.intp]
    compliance: Array
    play: Array
    load_0: Array

    @classmethod
    def of(cls, joints: Sequence[str], sets: Sequence[Sequence[ArmEffect]]) -> Self:
        """Returns the gears of an arm, a lane for each set of effects.

        Args:
            joints: of the arm.
            sets: effects, of each parameter set; one play at a joint.
        """
        c, b, load_0 = np.zeros((3, len(sets), len(joints)))
        for own, effects in enumerate(sets):
            for effect in effects:
                if isinstance(effect, JointElasticity):
                    c[own, joints.index(effect.joint)] += effect.compliance
                elif isinstance(effect, JointBacklash) and not effect.is_null:
                    at = own, joints.index(effect.joint)
                    b[at], load_0[at] = effect.play, effect.load
        which = np.flatnonzero((c + b).any(axis=0))
        load_0[load_0 == 0.0] = 1.0
        return cls(len(joints), which, *(x[:, which] for x in (c, b, load_0)))

    @property
    def any(self) -> bool:
        """Whether some gear in some lane yields or has play."""
        return len(self.which) > 0

    def repeated(self, times: int) -> "Gears":
        """Returns the same with each lane so many times in a row."""
        numbers = (self.compliance, self.play, self.load_0)
        repeated = (np.repeat(x, times, axis=0) for x in numbers)
        return Gears(self.joints, self.which, *repeated)

    def start(
        self, q: Array, v: Array, load: Array, rate: Array
    ) -> tuple[Array, Array]:
        """Returns coordinates and their rates (lanes, joints + e) at the begin.

        Args:
            q, v: (lanes, joints) of the motors.
            load, rate: (lanes, joints) that the gears pass on, and its derivative.
        """
        load, rate = load[:, self.which], rate[:, self.which]
        twist, soon = (
            self._twist_of(load + dt * rate, slice(None)) for dt in (0.0, _SOON)
        )
        q, v = self.with_links(q), self.with_links(v)
        q[:, self.joints :] -= twist
        v[:, self.joints :] -= (soon - twist) / _SOON
        return q, v

    def with_links(self, x: Array) -> Array:
        """Returns coordinates (..., joints + e) of links that follow their motors."""
        return np.concatenate([x, x[..., self.which]], axis=-1)

    def links(self, x: Array) -> Array:
        """Returns what coordinates (..., joints + e) are of the links."""
        if not self.any:
            return x
        found = x[..., : self.joints].copy()
        found[..., self.which] = x[..., self.joints :]
        return found

    def motors(self, x: Array) -> Array:
        """Returns what coordinates (..., joints + e) are of the motors."""
        return x[..., : self.joints]

    def missing(self, q: Array, a: Array, load: Array, lanes: Lanes) -> Array:
        """Returns what the gears pass on less what the links need (..., n, e) [N m].

        Of a rigid gear, by how much the motor's acceleration is the greater.

        Args:
            q, a: (..., n, joints + e) coordinates and accelerations.
            load: (..., n, joints) that the rigid bodies need.
            lanes: which n.
        """
        twist, apart = (x[..., self.which] - x[..., self.joints :] for x in (q, a))
        beyond = twist - self._twist_of(load[..., self.which], lanes)
        yields = (self.compliance + 0.5 * self.play / self.load_0)[lanes]
        is_rigid = yields == 0.0
        return np.where(is_rigid, apart, beyond / np.where(is_rigid, 1.0, yields))

    def _twist_of(self, load: Array, lanes: Lanes) -> Array:
        """Returns how far motors are ahead of links under loads (..., n, e)."""
        c, b = self.compliance[lanes], self.play[lanes]
        return np.asarray(c * load + 0.5 * b * np.tanh(load / self.load_0[lanes]))
