"""The library's experiments of an arm in free space."""

import dataclasses

import numpy as np

from drake_disasm.common.quantity import quantity
from drake_disasm.experiments.base import JointExperiment
from drake_disasm.experiments.registry import register_experiment
from drake_disasm.free_motion.arm_limits import JointLimits
from drake_disasm.free_motion.arm_space import ArmSpace
from drake_disasm.free_motion.fourier import FourierMotion
from drake_disasm.free_motion.rest_to_rest import PERIOD, straight
from drake_disasm.free_motion.table import MotionTable

_HARMONICS = 5
_SEEDS = (0.0, 1.0, 2.0, 3.0)


@register_experiment
@dataclasses.dataclass(frozen=True)
class JointExcitation(JointExperiment):
    """Swings all joints at once, each as a Fourier series of its own.

    Shows rigid bodies, loads and friction together, at all speeds between rest and the
    limits.
    """

    duration: float = quantity(
        20.0, "s", "of the motion", low=2.0, high=120.0, grid=(10.0, 20.0)
    )
    seed: float = quantity(0, "1", "of its coefficients", low=0, high=1e6, grid=_SEEDS)

    def motion(self, space: ArmSpace) -> MotionTable:
        """See JointExperiment."""
        random = np.random.default_rng(round(self.seed))
        shape = len(space.limits.names), _HARMONICS
        a, b = random.uniform(-1.0, 1.0, (2, *shape))
        series = FourierMotion(space.home, a, b, self.duration).at_rest()
        time = _times(self.duration)
        states = series.from_posture(space.home).states(time)
        factors = space.limits.largest(space.home, *states)
        fitted = series.scaled(factors).from_posture(space.home)
        return MotionTable(time, fitted.states(time)[0])


@register_experiment
@dataclasses.dataclass(frozen=True)
class JointStrokes(JointExperiment):
    """Takes all joints to and fro, each at one steady speed.

    Tells friction that depends on speed from friction that does not, by strokes that
    are slow and fast, and play from compliance, by their reversals.
    """

    speed: float = quantity(
        0.1,
        "1",
        "share of the greatest",
        low=0.005,
        high=1.0,
        grid=(0.02, 0.1, 0.4),
    )
    duration: float = quantity(10.0, "s", "of all", low=2.0, high=120.0)
    times: float = quantity(2, "1", "how often", low=1, high=20)

    def motion(self, space: ArmSpace) -> MotionTable:
        """See JointExperiment."""
        limits, times = space.limits, round(self.times)
        speed = self.speed * limits.velocity
        # A reversal is as soft as a mean over so many rows makes it.
        soft = np.ceil(speed / limits.acceleration / PERIOD).astype(int)
        quarter = np.ones(round(self.duration / (4.0 * times) / PERIOD))
        once = np.concatenate([quarter, -quarter, -quarter, quarter])
        sign = np.pad(np.tile(once, times), soft.max() + 1)
        means = [np.ones(2 * n + 1) / (2 * n + 1) for n in soft]
        v = np.stack([np.convolve(sign, mean, "same") for mean in means], axis=1)
        way = PERIOD * np.cumsum(speed * v, axis=0)
        q = space.home + _share_within(limits, space.home, way) * way
        return MotionTable(PERIOD * np.arange(len(q)), q)


@register_experiment
@dataclasses.dataclass(frozen=True)
class PostureSteps(JointExperiment):
    """Goes from one posture to the next and rests in each.

    Each step turns gravity's direction in the links: loads and a tilt of the base, at
    rest, where nothing rubs that moves.
    """

    postures: float = quantity(6, "1", "how many", low=1, high=50)
    reach: float = quantity(
        0.4, "1", "share of the way to anywhere", low=0.05, high=1.0
    )
    rest: float = quantity(1.0, "s", "in each", low=0.0, high=60.0)
    seed: float = quantity(0, "1", "of the postures", low=0, high=1e6, grid=_SEEDS)

    def motion(self, space: ArmSpace) -> MotionTable:
        """See JointExperiment."""
        limits = space.limits
        random = np.random.default_rng(round(self.seed))
        size = round(self.postures), len(limits.names)
        anywhere = random.uniform(limits.lower, limits.upper, size)
        drawn = space.home + self.reach * (anywhere - space.home)
        still = round(self.rest / PERIOD)
        rows = [space.home[None]]
        for one, other in zip([space.home, *drawn], [*drawn, space.home], strict=True):
            rows += [straight(limits, one, other), np.repeat(other[None], still, 0)]
        q = np.concatenate(rows)
        return MotionTable(PERIOD * np.arange(len(q)), q)


def _times(duration: float) -> np.ndarray:
    return PERIOD * np.arange(round(duration / PERIOD) + 1)


def _share_within(limits: JointLimits, home: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Returns how much of ways (n, joints) from home each joint's range takes."""
    room = np.where(q > 0.0, limits.upper - home, home - limits.lower)
    return np.asarray(np.minimum(1.0, 1.0 / np.max(np.abs(q) / room, axis=0)))
