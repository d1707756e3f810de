"""What rivals predict of motions of an arm in free space, and whether these are safe.

Each rival's model is given a log of the motion as if it had been recorded.
"""

import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Self

import numpy as np
from scipy.interpolate import CubicSpline

from drake_disasm.common.progress import Progress, ProgressUpdate, ignore_progress
from drake_disasm.experiments import JointPlan
from drake_disasm.free_motion.arm_space import ArmSpace
from drake_disasm.free_motion.table import MotionTable
from drake_disasm.logs import Episode, Log, LogHeader
from drake_disasm.logs.columns import flat_columns
from sysid.diagnosis.design import Forecast
from sysid.diagnosis.rivals import AS_IT_IS, Rival, varied_parameters
from sysid.fitting.candidates import Candidate, extended
from sysid.fitting.fit import Fit
from sysid.models.base import Array, LogModel
from sysid.models.joint_motion import JointMotionModel
from sysid.models.regressor import ArmRegressor
from sysid.models.response.model import JointResponseModel

_MARGIN = 0.7  # of the greatest torque of each joint
_LEAST = 0.01  # rad or m, of the joint that moves most
_LATE = 0.05  # s, by which a servo may follow, until its response is simulated


@dataclasses.dataclass(frozen=True)
class ArmRival(Rival):
    """A hypothesis about an arm in free space.

    Attributes:
        effects: that it has.
        values: of the model's parameters, by name; `varied` has such, too.
        sigma: (channels,) by which a row may differ anyway.
    """

    effects: tuple[Candidate, ...]
    values: Mapping[str, float]
    sigma: Array

    @classmethod
    def of(cls, name: str, fit: Fit, weight: float, loss: float) -> Self:
        """Returns the hypothesis of a fit to a log of an arm; see `rivals.Make`."""
        names = [parameter.name for parameter in fit.model.parameters]
        varied = [
            dict(zip(names, theta.tolist(), strict=True))
            for theta in varied_parameters(fit)
        ]
        sigma = np.sqrt(np.mean(np.atleast_2d(fit.model.measurements.sigma) ** 2, 0))
        effects, values = fit.effects, fit.values
        return cls(name, weight, loss, effects, values, sigma, varied=tuple(varied))

    def predictions(self, model: LogModel) -> Iterator[Array]:
        """Yields what it predicts of a log (rows, channels), and what if varied.

        Args:
            model: of the log, without effects.
        """
        with_effects, _ = extended(model, self.effects, with_shapes=True)
        names = [parameter.name for parameter in with_effects.parameters]
        for values in (self.values, *self.varied):
            yield with_effects.predictions(np.array([values[name] for name in names]))


def arm_forecasts(
    plans: Sequence[JointPlan],
    rivals: Sequence[ArmRival],
    space: ArmSpace,
    log: Log,
    progress: Progress = ignore_progress,
) -> list[Forecast]:
    """Returns what rivals predict of experiments.

    Args:
        plans: experiments in the space.
        rivals: each a fit to the log.
        space: limits of the arm.
        log: so far.
        progress: gets each experiment.
    """
    is_of_torques = log.header.kind == "joint_motion"
    imagine = _imagined_torques if is_of_torques else _imagined_response
    joints, found = log.header.joints, []
    for number, plan in enumerate(plans):
        progress(ProgressUpdate("predicting", number, len(plans), plan.text))
        model = imagine(log, plan.motion, rivals[0])
        predicted = [list(rival.predictions(model)) for rival in rivals]
        sigma = rivals[0].sigma
        signals = [[(x / sigma).ravel() for x in own] for own in predicted]
        first = np.array([own[0] for own in predicted])
        i = int(np.argmax(np.sum(np.ptp(first / sigma, axis=0) ** 2, axis=0)))
        torques = _torques(log, plan.motion, first)
        channel = model.measurements.channels[i]
        found.append(
            Forecast(
                plan,
                float(plan.motion.time[-1]),
                (0.0, float(np.abs(torques).max())),
                signals,
                joints[i],
                channel.unit,
                [own[:, i] for own in first],
                _period(log),
                _hazard(plan, torques, [rival.name for rival in rivals], space),
            )
        )
    return found


def _torques(log: Log, motion: MotionTable, predicted: Array) -> Array:
    """Returns the joints' torques (k, n, joints) under each rival.

    Those that a log of torques predicts, else those of the URDF.
    """
    if log.header.kind == "joint_motion":
        return predicted
    own = _torques_of_urdf(log.header, motion)
    return np.repeat(own[None], len(predicted), axis=0)


def _torques_of_urdf(header: LogHeader, motion: MotionTable) -> Array:
    """Returns the joints' torques (n, joints) that a motion takes by the URDF."""
    arm = ArmRegressor(str(header.urdf), header.joints)
    return np.asarray(arm.torques(*_states(motion, motion.time)))


def hazard_without_effects(plan: JointPlan, header: LogHeader, space: ArmSpace) -> str:
    """Returns why an experiment is not safe by the URDF; empty if it is.

    Args:
        plan: of it.
        header: of the recordings.
        space: limits of the arm.
    """
    torques = _torques_of_urdf(header, plan.motion)
    return _hazard(plan, torques[None], [AS_IT_IS], space)


def _hazard(
    plan: JointPlan, torques: Array, rivals: Sequence[str], space: ArmSpace
) -> str:
    """Returns why an experiment is not performed; empty if it may be."""
    if np.ptp(plan.motion.q, axis=0).max() < _LEAST:
        return "there is no room for it"
    share = np.abs(torques).max(axis=1) / space.limits.effort
    k, joint = np.unravel_index(int(share.argmax()), share.shape)
    if share[k, joint] <= _MARGIN:
        return ""
    return (
        f"under {rivals[int(k)]} {space.limits.names[int(joint)]} takes "
        f"{np.abs(torques[k, :, joint]).max():.1f} N m, above {100 * _MARGIN:.0f} % of "
        "what is allowed"
    )


def _states(motion: MotionTable, time: Array) -> tuple[Array, Array, Array]:
    """Returns q, v and vd (n, joints) of a motion."""
    spline = CubicSpline(motion.time, motion.q, bc_type="clamped")
    q, v, vd = (np.asarray(spline(time, k)) for k in range(3))
    return q, v, vd


def _imagined_torques(log: Log, motion: MotionTable, _: ArmRival) -> LogModel:
    """Returns the model of a motion as if its torques had been recorded."""
    time = _rows(log, motion)
    q, v, vd = _states(motion, time)
    columns = {"time": time, "q": q, "v": v, "vd": vd, "tau": np.zeros_like(q)}
    return JointMotionModel([_with_episode(log, columns)])


def _imagined_response(log: Log, motion: MotionTable, first: ArmRival) -> LogModel:
    """Returns the model of a motion as if its response had been recorded.

    Which begins each segment where the first rival's has come to.
    """
    time = _rows(log, motion)
    commanded, v, _ = _states(motion, time)
    columns = {"time": time, "q_commanded": commanded, "v": v}
    late = _states(motion, np.maximum(time - _LATE, 0.0))[0]
    whole = JointResponseModel(
        [_with_episode(log, columns | {"q": late})], segment=np.inf
    )
    q = next(first.with_known_parameters.predictions(whole))
    return JointResponseModel([_with_episode(log, columns | {"q": q})])


def _rows(log: Log, motion: MotionTable) -> Array:
    """Returns times of rows that are as far apart as the log's [s]."""
    period = _period(log)
    rows = int(motion.time[-1] / period) + 1
    return np.asarray(period * np.arange(rows), dtype=np.float64)


def _period(log: Log) -> float:
    """Returns how far apart a log's rows are [s]."""
    return float(np.median(np.diff(log.episodes[0]["time"])))


def _with_episode(log: Log, columns: Mapping[str, Array]) -> Log:
    """Returns a log with these columns as its only episode."""
    flat = flat_columns(log.header.kind, columns)
    episode = Episode("imagined", Path("imagined"), flat)
    return dataclasses.replace(log, episodes=(episode,))
