"""Lost motion: a gear has play."""

import dataclasses
from typing import ClassVar

from drake_disasm.common.arrays import Array, limited
from drake_disasm.effects.base import Memory, MotionEffect
from drake_disasm.effects.fields import amplitude
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class Backlash(MotionEffect):
    """Play between command and motion: nothing moves until the play is taken up.

    Equation: the play operator, d_k = min(max(d_(k-1), c_k - b/2), c_k + b/2) with c
    the command and b = [x, y, z, u, v, w] the play, which begins centred.
    Where it acts: on the commanded pose, before inverse kinematics; the measured pose
    shows it.
    """

    x: float = amplitude("m", 0.0, 0.005, "play along x_G")
    y: float = amplitude("m", 0.0, 0.005, "play along y_G")
    z: float = amplitude("m", 0.0, 0.005, "play along z_G")
    u: float = amplitude("rad", 0.0, 0.05, "play about x_G")
    v: float = amplitude("rad", 0.0, 0.05, "play about y_G")
    w: float = amplitude("rad", 0.0, 0.05, "play about z_G")

    stage = 2
    noun = "backlash of the arm"
    experiment = "reversals after long and short steps, in free space and under load"
    experiments_against: ClassVar = {
        "Compliance": "the same reversals under two loads: backlash does not grow",
    }

    def execute(
        self, commanded: Array, wrench: Array, memory: Memory, period: float
    ) -> tuple[Array, Memory]:
        """See MotionEffect; the memory is the pose before."""
        play = self.vector(commanded, "x", "y", "z", "u", "v", "w")
        executed = limited(memory, commanded - play / 2.0, commanded + play / 2.0)
        return executed, executed
