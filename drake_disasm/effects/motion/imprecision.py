"""The arm is less precise than declared."""

import dataclasses

import numpy as np

from drake_disasm.effects.base import Memory, MotionEffect
from drake_disasm.effects.fields import amplitude
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class Imprecision(MotionEffect):
    """Where a command leads scatters: an effect on the variance, not on the mean.

    Equation: d_k = c_k + [x, y, z] n_k, with n_k ~ N(0, 1) anew at each step; rotations
    pass. A scenario's `imprecision` (algorithm 3.2) scatters the *action*, of which
    the log tells; this scatters about the command, and nobody tells.
    Where it acts: on the commanded pose, behind all other effects on the motion.

    n_k is a pseudo-random function of the command and of how many came before, so
    that the effect has no state of its own: the same run again scatters alike, and
    any other differently.
    """

    x: float = amplitude("m", 0.0, 0.002, "standard deviation along x_G")
    y: float = amplitude("m", 0.0, 0.002, "standard deviation along y_G")
    z: float = amplitude("m", 0.0, 0.002, "standard deviation along z_G")

    stage = 4
    is_random = True

    def execute(
        self, commanded: np.ndarray, wrench: np.ndarray, memory: Memory, period: float
    ) -> tuple[np.ndarray, Memory]:
        """See MotionEffect; the memory counts commands."""
        seed = np.concatenate([commanded, memory[:1]]).view(np.uint32)
        n = np.random.default_rng(seed).standard_normal(3)
        away = np.array([self.x, self.y, self.z]) * n
        return commanded + np.append(away, np.zeros(3)), memory + 1.0
