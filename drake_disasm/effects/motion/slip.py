"""The bolt slips in the gripper."""

import dataclasses

from drake_disasm.common.arrays import Array, last_axis
from drake_disasm.effects.base import Memory, MotionEffect
from drake_disasm.effects.fields import amplitude
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class BoltSlip(MotionEffect):
    """The bolt creeps in the gripper under a force, and does not return.

    Equation: d_executed = d_commanded + s, ds/dt = C F with C = diag(x, y, z) and F the
    measured force on the bolt in G: a viscous grip. Positions are the bolt's, as an
    outside frame or a re-grasp would show them.
    Where it acts: between gripper and bolt.
    """

    x: float = amplitude("m/(N s)", 0.0, 1e-3, "creep along x_G")
    y: float = amplitude("m/(N s)", 0.0, 1e-3, "creep along y_G")
    z: float = amplitude("m/(N s)", 0.0, 1e-3, "creep along z_G")

    stage = 3
    noun = "slip of the bolt in the grip"
    experiment = "a strong pull and back: slip stays, compliance returns"

    def execute(
        self, commanded: Array, wrench: Array, memory: Memory, period: float
    ) -> tuple[Array, Memory]:
        """See MotionEffect; the memory is the slip so far."""
        creep = last_axis([self.x, self.y, self.z, 0.0, 0.0, 0.0], commanded)
        slip = memory + creep * wrench * period
        return commanded + slip, slip
