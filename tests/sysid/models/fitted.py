"""Least squares of an arm's log."""

from collections.abc import Sequence

import numpy as np

from drake_disasm.effects import Effect
from drake_disasm.logs import Log
from drake_disasm.scenario import Scenario
from sysid.models.joint_motion import JointMotionModel


def fitted(log: Log, effects: Sequence[Effect]) -> tuple[np.ndarray, float]:
    """Returns effects' sizes by least squares, and the standard deviation left.

    Fitted with all base parameters.

    Args:
        log: of an arm's torques.
        effects: each of size one, in the amplitude that is fitted.
    """
    bare = JointMotionModel([log])
    theta = np.array([p.nominal for p in bare.parameters])
    still = bare.predictions(theta)
    columns = [column.reshape(-1) for column in np.moveaxis(bare._motion.Y, -1, 0)]
    for effect in effects:
        model = JointMotionModel([log], scenario=Scenario(effects=[effect]))
        columns.append((model.predictions(theta) - still).reshape(-1))
    A, tau = np.stack(columns, axis=1), bare.measurements.values.reshape(-1)
    x, *_ = np.linalg.lstsq(A, tau, rcond=None)
    return x[len(theta) :], float(np.std(tau - A @ x))
