"""By how much one stream's clock is off another's, from what both saw."""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.multibody.plant import MultibodyPlant
from scipy.optimize import minimize_scalar
from scipy.stats import t as student

from drake_disasm.cell.parsing import add_model
from drake_disasm.logs.importing.cutoff import chosen_cutoff, motion_spectra
from drake_disasm.logs.importing.signals import (
    LARGEST_CUTOFF,
    LowPass,
    even_times,
    longest_stretch,
    resample,
)

Array = NDArray[np.float64]

_LARGEST = 0.1  # s, that is looked for
_STEPS = 81  # of the first search
_BLOCKS = 10  # of the record, for the interval
_LEAST_SHARE = 0.9  # of a channel's variance: less tells nothing of a shift
_TINY = 1e-20


@dataclasses.dataclass(frozen=True)
class Shift:
    """What has to be added to a stream's times.

    Attributes:
        seconds: estimate.
        low, high: its 95 % interval [s].
        explained: share of a channel's variance that the other stream explains, of the
            channel where that is most.
    """

    seconds: float
    low: float
    high: float
    explained: float

    @property
    def is_seen(self) -> bool:
        """Whether the streams have enough in common to tell."""
        return self.explained >= _LEAST_SHARE


#: A shift that can't be told.
UNKNOWN = Shift(0.0, -np.inf, np.inf, 0.0)
#: Joints whose load's force is known to `joint_features`; of more it depends on where
#: they are on one another.
MOST_JOINTS = 2

#: What a stream's channels may depend on linearly: from q, v, vd (n, j) to (n, m).
Features = Callable[[Array, Array, Array], Array]


def joint_features(q: Array, v: Array, vd: Array) -> Array:
    """Returns what the force of a load may depend on where the arm is not known.

    The position, its sine and cosine, the acceleration, and products of two velocities;
    enough for `MOST_JOINTS`.
    """
    i, j = np.triu_indices(q.shape[1])
    columns = [np.ones((len(q), 1)), q, np.sin(q), np.cos(q), vd, v[:, i] * v[:, j]]
    return np.concatenate(columns, axis=1)


def link_features(urdf: str, joints: Sequence[str]) -> Features:
    """Returns what the wrench of a rigid load on what the last joint moves depends on.

    Gravity less acceleration, angular acceleration, and products of two angular
    velocities, all in the link's frame: the load's ten inertial parameters and the
    sensor's pose on the link are factors of these.

    Args:
        urdf: of the arm.
        joints: names of its joints, in the order of q.
    """
    plant = MultibodyPlant(0.0)
    add_model(plant, urdf)
    plant.Finalize()
    context = plant.CreateDefaultContext()
    at_rest = plant.GetPositionsAndVelocities(context)
    chosen = [plant.GetJointByName(name) for name in joints]
    columns = [joint.velocity_start() for joint in chosen]
    rows = [joint.position_start() for joint in chosen]
    link = min(chosen, key=lambda joint: _moved(plant, joint)).child_body()
    gravity = plant.gravity_field().gravity_vector()
    i, j = np.triu_indices(3)

    def features(q: Array, v: Array, vd: Array) -> Array:
        """Returns the features (n, 13) of each row."""
        found = np.ones((len(q), 13))
        state = at_rest.copy()
        rates = np.zeros(plant.num_velocities())
        speeds = plant.num_positions() + np.array(columns)
        for row in range(len(q)):
            state[rows], state[speeds], rates[columns] = q[row], v[row], vd[row]
            plant.SetPositionsAndVelocities(context, state)
            A_WL = plant.CalcSpatialAccelerationsFromVdot(context, rates)[link.index()]
            R_LW = plant.EvalBodyPoseInWorld(context, link).rotation().inverse()
            V_WL = plant.EvalBodySpatialVelocityInWorld(context, link)
            w_L = R_LW @ V_WL.rotational()
            found[row, 1:4] = R_LW @ (gravity - A_WL.translational())
            found[row, 4:7] = R_LW @ A_WL.rotational()
            found[row, 7:] = w_L[i] * w_L[j]
        return found

    return features


def _moved(plant: MultibodyPlant, joint: Any) -> int:
    """Returns how many bodies a joint moves: the last one of a chain the fewest."""
    return len(plant.GetBodiesKinematicallyAffectedBy([joint.index()]))


def motion_features(
    time: Array, q: Array, features: Features = joint_features
) -> tuple[Array, Array, float]:
    """Returns times (m,), what forces depend on then (m, k), and its cut-off [Hz].

    They are of the longest stretch without a gap, and the same if time ran backwards.
    A shift in time is not, so that these can't make up for it; velocities could.

    Args:
        time: (n,) increasing [s].
        q: (n, j) positions of the joints.
        features: of q and its derivatives.
    """
    longest = longest_stretch(time)
    time, q = time[longest], q[longest]
    at = even_times(time)
    period = float(at[1] - at[0])
    even = resample(time, q, at)
    low = LowPass(chosen_cutoff(motion_spectra([even], period), period), period)
    if len(at) < 4 * low.reach:
        return at, np.ones((len(at), 1)), low.cutoff
    every = low.decimation
    rows = slice(low.reach, -low.reach, every)
    moved = [low(even, order)[::every] for order in range(3)]
    return at[rows], features(*moved), low.cutoff


def estimated_shift(
    time: Array, features: Array, cutoff: float, other_time: Array, other: Array
) -> Shift:
    """Returns the shift of a stream at which another explains most of it.

    The least squares of the stream's channels on the other's features, at each of many
    shifts; then about the best, block by block, what the residual says of a further
    one: its regression on the stream's own slope. The spread of blocks gives the
    interval.

    Args:
        time, features, cutoff: by `motion_features`, of the stream that is right.
        other_time, other: (p,) [s] and (p, k), of the one whose times may be off.
    """
    other_time, other = _low_passed(other_time, other, cutoff)
    margin = _LARGEST + 2 * float(np.median(np.diff(other_time)))
    low, high = other_time[0] + margin, other_time[-1] - margin
    inside = (time >= low) & (time <= high)
    if inside.sum() < 4 * features.shape[1]:
        return UNKNOWN
    t, basis = time[inside], np.linalg.qr(features[inside])[0]
    scale = np.maximum(other.std(axis=0), 1e-12)

    def left(seconds: float) -> Array:
        """Returns what the features leave of the stream at a shift (n, k)."""
        values = resample(other_time, other, t - seconds) / scale
        values = values - values.mean(axis=0)
        return values - basis @ (basis.T @ values)

    def loss(seconds: float) -> float:
        """Returns the logarithm of the likelihood, noise differing by channel."""
        return float(np.sum(np.log(np.sum(left(seconds) ** 2, axis=0) + _TINY)))

    grid = np.linspace(-_LARGEST, _LARGEST, _STEPS)
    best = float(grid[np.argmin([loss(s) for s in grid])])
    step = grid[1] - grid[0]
    found = minimize_scalar(loss, bounds=(best - step, best + step), method="bounded")
    seconds = float(np.clip(found.x, -_LARGEST, _LARGEST))
    spread = _spread(left, seconds)
    share = 1.0 - float(np.min(np.mean(left(seconds) ** 2, axis=0)))
    return Shift(seconds, seconds - spread, seconds + spread, share)


def _low_passed(time: Array, values: Array, cutoff: float) -> tuple[Array, Array]:
    """Returns a stream's longest stretch through the same filter as the motion.

    Noise would be less between rows than on them, so that shifts by half a period
    would seem better than they are.
    """
    longest = longest_stretch(time)
    time, values = time[longest], values[longest]
    at = even_times(time)
    period = float(at[1] - at[0])
    low = LowPass(min(cutoff, LARGEST_CUTOFF * 0.5 / period), period)
    if len(at) < 4 * low.reach:
        return time, values
    return at[low.reach : -low.reach], low(resample(time, values, at))


def _spread(left: Callable[[float], Array], seconds: float) -> float:
    """Returns half the 95 % interval of a shift, from the spread of its blocks."""
    h = 1e-3
    slope = (left(seconds + h) - left(seconds - h)) / (2.0 * h)
    residual = left(seconds)
    noise = np.sqrt(np.mean(residual**2, axis=0) + _TINY)
    residual, slope = residual / noise, slope / noise
    parts = zip(
        np.array_split(residual, _BLOCKS), np.array_split(slope, _BLOCKS), strict=True
    )
    weights, steps = [], []
    for own, own_slope in parts:
        weight = float(np.sum(own_slope**2))
        if weight > 0.0:
            weights.append(weight)
            steps.append(-float(np.sum(own * own_slope)) / weight)
    share = np.array(weights) / np.sum(weights)
    mean = share @ np.array(steps)
    variance = np.sum(share**2 * (np.array(steps) - mean) ** 2)
    return float(student.ppf(0.975, len(steps) - 1) * np.sqrt(variance))
