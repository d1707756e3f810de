"""Designs a motion: as informative as limits, collisions and the floor allow."""

import dataclasses
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.progress import Progress, ProgressUpdate, ignore_progress
from drake_disasm.free_motion.arm_limits import CollisionFreeSpace, JointLimits
from drake_disasm.free_motion.fourier import FourierMotion
from sysid.experiment_design.information import ArmExperiment, condition_of

Array = NDArray[np.float64]

_SAMPLES_PER_HARMONIC = 8
_PENALTY = 1e4  # of the criterion: 1 for 1 cm, or 1 % of a torque limit, at one sample
_EVALUATIONS = 2  # gradients for each iteration, at most: dry friction has kinks
_LEAST_GAIN = 0.05  # of what a joint's limits allow
_CHECKED = 100.0  # Hz
_SHRINKS = 12  # halvings of the step in which a motion is made to fit


@dataclasses.dataclass(frozen=True)
class DesignSettings:
    """What a motion may be, and how long it is searched for.

    Attributes:
        duration: of the motion [s].
        harmonics: of its Fourier series.
        rate: of the recording [Hz].
        clearance: of links from each other, at least [m].
        floor: height that no moving link's origin may be below [m], or None.
        starts: random motions, of which the best is improved.
        iterations: of that.
        seed: of the random motions.
    """

    duration: float = 20.0
    harmonics: int = 5
    rate: float = 200.0
    clearance: float = 0.02
    floor: float | None = None
    starts: int = 50
    iterations: int = 30
    seed: int = 0


@dataclasses.dataclass(frozen=True)
class Figures:
    """How well a motion shows the unknowns.

    Attributes:
        criterion: see `ArmExperiment.criterion`.
        condition: see `condition_of`.
    """

    criterion: float
    condition: float

    @classmethod
    def of(cls, experiment: ArmExperiment, information: Array) -> Self:
        """Returns those of an information matrix."""
        return cls(experiment.criterion(information), condition_of(information))


@dataclasses.dataclass(frozen=True)
class Design:
    """A motion, and what recording it would tell.

    Attributes:
        motion: within all limits.
        before, after: figures of the median random motion and of this one.
        spreads: half the 95 % interval of each unknown of the experiment.
        used: share of each limit that it uses, by the limit's name, (joints,).
        clearance: least distance of links, and of their origins from z = 0 [m].
        height: the latter.
    """

    motion: FourierMotion
    before: "Figures"
    after: "Figures"
    spreads: Array
    used: dict[str, Array]
    clearance: float
    height: float


def design_motion(
    experiment: ArmExperiment,
    limits: JointLimits,
    workspace: CollisionFreeSpace,
    settings: DesignSettings,
    progress: Progress = ignore_progress,
) -> Design:
    """Returns the most informative motion that a search finds.

    The best of some random motions is improved by L-BFGS with differences. Joint
    limits hold by scaling: whatever the coefficients are, each joint moves by a share
    of what its limits allow. Torques, clearance and floor cost a penalty, and a motion
    that violates them between the samples at last is shrunk about its centre.

    Args:
        experiment: what is to be shown.
        limits, workspace: what holds.
        settings: of motion and search.
        progress: gets each step; may raise to stop.

    Raises:
        DisasmError: not even rest is allowed in any posture tried.
    """
    search = _Search(experiment, limits, workspace, settings)
    random = np.random.default_rng(settings.seed)
    values, points = [], []
    for number in range(settings.starts):
        points.append(search.random_point(random))
        values.append(search.value(points[-1]))
        progress(ProgressUpdate("random motions", number + 1, settings.starts))
    if not any(search.can_rest(point) for point in points):
        raise DisasmError(
            f"no motion: in {settings.starts} random postures the clearance, the floor "
            "or a torque is violated even at rest; relax `clearance` or `floor`"
        )
    best = points[int(np.argmin(values))]
    found = _improved(search, best, settings.iterations, progress)
    random_ones = [
        Figures.of(experiment, search.information(search.motion(p))) for p in points
    ]
    median = Figures(
        float(np.median([f.criterion for f in random_ones])),
        float(np.median([f.condition for f in random_ones])),
    )
    return search.design(search.allowed(found), median)


def _improved(
    search: "_Search", start: Array, iterations: int, progress: Progress
) -> Array:
    """Returns the least that L-BFGS finds from a point."""
    done = 0

    def told(_: Array) -> None:
        """Reports an iteration."""
        nonlocal done
        done += 1
        progress(ProgressUpdate("improving the best", done, iterations))

    bounds = [(-1.0, 1.0)] * len(start)
    most = _EVALUATIONS * iterations * (len(start) + 1)
    found = minimize(  # type: ignore[call-overload]
        search.value,
        start,
        method="L-BFGS-B",
        bounds=bounds,
        callback=told,
        options={"maxiter": iterations, "maxfun": most, "eps": 1e-4},
    )
    return np.asarray(found.x)


class _Search:
    """Points in the cube [-1, 1]: a, b, centre and gain of each joint's motion."""

    def __init__(
        self,
        experiment: ArmExperiment,
        limits: JointLimits,
        workspace: CollisionFreeSpace,
        settings: DesignSettings,
    ) -> None:
        self._experiment, self._limits = experiment, limits
        self._workspace, self._settings = workspace, settings
        count = _SAMPLES_PER_HARMONIC * settings.harmonics
        self._time = np.linspace(0.0, settings.duration, count, endpoint=False)

    def random_point(self, random: np.random.Generator) -> Array:
        """Returns a point anywhere in the cube."""
        joints, size = len(self._limits.names), 2 * self._settings.harmonics + 2
        return random.uniform(-1.0, 1.0, (joints, size)).reshape(-1)

    def motion(self, point: Array) -> FourierMotion:
        """Returns the motion of a point, within the joints' limits."""
        limits, settings = self._limits, self._settings
        x = point.reshape(len(limits.names), -1)
        size = settings.harmonics
        middle = 0.5 * (limits.upper + limits.lower)
        half = 0.5 * (limits.upper - limits.lower)
        centre = middle + 0.9 * half * x[:, -2]
        a, b = x[:, :size], x[:, size : 2 * size]
        motion = FourierMotion(centre, a, b, settings.duration).at_rest()
        gain = _LEAST_GAIN + (1.0 - _LEAST_GAIN) * 0.5 * (x[:, -1] + 1.0)
        dense = np.linspace(0.0, settings.duration, 40 * size)
        most = limits.largest(centre, *motion.states(dense))
        return motion.scaled(gain * most)

    def value(self, point: Array) -> float:
        """Returns the criterion of a point's motion, with penalties."""
        motion = self.motion(point)
        excess = self._excess(*motion.states(self._time))
        told = self._experiment.criterion(self.information(motion))
        return told + _PENALTY * float(excess @ excess)

    def information(self, motion: FourierMotion, time: Array | None = None) -> Array:
        """Returns the information matrix of a recording of a motion.

        Args:
            motion: to be recorded.
            time: (n,) of samples that stand for all rows; None: those of the search.
        """
        time = self._time if time is None else time
        columns = self._experiment.columns(time, *motion.states(time))
        rows = int(self._settings.duration * self._settings.rate)
        return self._experiment.information(columns, rows)

    def can_rest(self, point: Array) -> bool:
        """Returns whether rest at the centre of a point's motion is allowed."""
        rest = self.motion(point).scaled(0.0).states(self._time[:1])
        return not self._excess(*rest).any()

    def allowed(self, point: Array) -> FourierMotion:
        """Returns a point's motion, shrunk about its centre until all limits hold."""
        motion, low, high = self.motion(point), 0.0, 1.0
        if self._is_allowed(motion):
            return motion
        if not self.can_rest(point):
            raise DisasmError(
                "no motion: even at rest in the best posture found a torque, the "
                "clearance or the floor is violated; relax `clearance` or `floor`"
            )
        for _ in range(_SHRINKS):
            middle = 0.5 * (low + high)
            fits = self._is_allowed(motion.scaled(middle))
            low, high = (middle, high) if fits else (low, middle)
        return motion.scaled(low)

    def design(self, motion: FourierMotion, before: Figures) -> Design:
        """Returns a motion with what it tells, measured all along it."""
        limits = self._limits
        q, v, vd = motion.states(self._dense)
        information = self.information(motion, self._dense)
        room = np.maximum(limits.upper - limits.lower, 1e-12)
        torques = self._experiment.torques(q, v, vd)
        used = {
            "range": np.ptp(q, axis=0) / room,
            "velocity": np.abs(v).max(axis=0) / limits.velocity,
            "acceleration": np.abs(vd).max(axis=0) / limits.acceleration,
            "torque": np.abs(torques).max(axis=0) / limits.effort,
        }
        return Design(
            motion,
            before,
            Figures.of(self._experiment, information),
            self._experiment.spreads(information),
            used,
            float(self._workspace.clearance(q).min()),
            float(self._workspace.height(q).min()),
        )

    @property
    def _dense(self) -> Array:
        count = int(self._settings.duration * _CHECKED)
        return np.linspace(0.0, self._settings.duration, count)

    def _is_allowed(self, motion: FourierMotion) -> bool:
        return not self._excess(*motion.states(self._dense)).any()

    def _excess(self, q: Array, v: Array, vd: Array) -> Array:
        """Returns by how much each sample violates torques, clearance and floor, (n,).

        As shares of the torque limits plus metres; 0 where it violates none.
        """
        settings = self._settings
        torques = self._experiment.torques(q, v, vd)
        found = np.maximum(np.abs(torques) / self._limits.effort - 1.0, 0.0).sum(axis=1)
        if self._workspace.has_geometry:
            least = settings.clearance
            found += least - self._workspace.clearance(q, least)
        if settings.floor is not None:
            low = settings.floor - self._workspace.height(q)
            found += np.maximum(low, 0.0)
        return np.asarray(found)
