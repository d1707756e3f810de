"""The arm is less precise than the scenario says."""

import dataclasses

import numpy as np

from drake_disasm.effects.base import Memory, MotionEffect
from drake_disasm.effects.fields import amplitude
from drake_disasm.effects.registry import register_effect


@register_effect
@dataclasses.dataclass
class Imprecision(MotionEffect):
    """The executed pose scatters about the commanded one: variance, not mean.

    Equation: d_k = c_k + [x, y, z] n_k, with n_k ~ N(0, 1) drawn at each step;
    rotations are exact. A scenario's `imprecision` (algorithm 3.2) scatters the
    *action*, which the log records; this scatters about the command, unrecorded.
    Where it acts: on the commanded pose, after all other effects on the motion.

    n_k is a pseudo-random function of the command and of the number of commands
    before it, so that the effect has no generator of its own: the same run repeats
    its scatter, any other run has another.
    """

    x: float = amplitude("m", 0.0, 0.002, "standard deviation along x_G")
    y: float = amplitude("m", 0.0, 0.002, "standard deviation along y_G")
    z: float = amplitude("m", 0.0, 0.002, "standard deviation along z_G")

    stage = 4
    is_random = True
    noun = "scatter of the arm about its commands"
    experiment = "the same steps many times over in free space: how far they scatter"

    def execute(
        self, commanded: np.ndarray, wrench: np.ndarray, memory: Memory, period: float
    ) -> tuple[np.ndarray, Memory]:
        """See MotionEffect; the memory counts commands."""
        seed = np.concatenate([commanded, memory[:1]]).view(np.uint32)
        n = np.random.default_rng(seed).standard_normal(3)
        away = np.array([self.x, self.y, self.z]) * n
        return commanded + np.append(away, np.zeros(3)), memory + 1.0
