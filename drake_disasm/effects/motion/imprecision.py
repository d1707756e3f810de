"""The arm is less precise than the scenario says."""

import dataclasses

import numpy as np

from drake_disasm.common.arrays import Array, array_like, last_axis, to_numpy
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
        self, commanded: Array, wrench: Array, memory: Memory, period: float
    ) -> tuple[Array, Memory]:
        """See MotionEffect; the memory counts commands."""
        count = to_numpy(memory)[..., :1]
        keys = np.concatenate([to_numpy(commanded), count], axis=-1)
        drawn = [_numbers(key) for key in keys.reshape(-1, keys.shape[-1])]
        n = array_like(np.reshape(drawn, commanded.shape), commanded)
        away = last_axis([self.x, self.y, self.z, 0.0, 0.0, 0.0], commanded)
        return commanded + away * n, memory + 1.0


def _numbers(key: np.ndarray) -> np.ndarray:
    """Returns normal numbers (6,) that are a function of others (7,)."""
    seed = np.ascontiguousarray(key).view(np.uint32)
    return np.append(np.random.default_rng(seed).standard_normal(3), np.zeros(3))
