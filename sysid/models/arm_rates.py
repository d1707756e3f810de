"""How fast the arm moves, which no encoder measures, and where it goes."""

import dataclasses
from typing import Self

import numpy as np

from drake_disasm.cell.grip import AXIS_ORDER
from drake_disasm.cell.twin_parameters import twin_of
from drake_disasm.common.spatial import velocity_shift
from drake_disasm.scenario import Scenario
from drake_disasm.twin.arm_step import ArmStep
from sysid.models.base import Array


@dataclasses.dataclass(frozen=True)
class ArmRates:
    """Estimates the arm's rates at the end of a step from where it was and went.

    Where it went tells its mean rate; the model says by how much the rate at the end is
    another, as after a command that turned back. When in the step a force came nobody
    knows: of an arm in impedance control, which lags by several steps, it is taken to
    grow evenly; of a stiff arm, which feels a contact for a moment, not to change. An
    error of the rate at the begin is gone after a step or two: of a free mass at once.

    Attributes:
        step: of the arm in one period of the task; coordinates as in the twin.
        to_grip: (6, 6) wrench at the pads by that on the bolt at Bo, in Gn.
        lags: whether the arm is in impedance control.
    """

    step: ArmStep
    to_grip: Array
    lags: bool

    @classmethod
    def of(cls, scenario: Scenario) -> Self:
        """Returns the estimate for a scenario's arm, control and gripper."""
        twin = twin_of(scenario)
        step = ArmStep.of(twin.arm, twin.grip, scenario.task.period)
        lags = scenario.arm.control != "position"
        return cls(step, velocity_shift(twin.p_BoTo_B).T, lags)

    def after(self, v: Array, q: Array, qd: Array, wrench: Array) -> Array:
        """Returns the rates (n, 6) at the end of steps.

        Args:
            v: (n, 6) rates at the begin.
            q, qd: (n, 2, 6) measured and commanded coordinates at begin and end.
            wrench: (n, 2, 6) measured on the bolt then, [f; tau] at Bo in Gn.
        """
        load = wrench if self.lags else wrench[:, [0, 0]]
        ahead = self._ahead(np.hstack([q[:, 0], v]), qd, load)
        return np.asarray(ahead[:, 6:] + (q[:, 1] - ahead[:, :6]) / self.step.h)

    def along(self, q: Array, qd: Array, wrench: Array) -> Array:
        """Returns the rates (n, 6) as an episode's steps begin, from rest on.

        Args:
            q, qd, wrench: (n + 1, 6), see `after`.
        """
        pairs = [np.stack([a[:-1], a[1:]], axis=1) for a in (q, qd, wrench)]
        from_rest = self.after(np.zeros((len(q) - 1, 6)), *pairs)
        carries_on = self.step.F[6:, 6:] - self.step.F[:6, 6:] / self.step.h
        v = np.zeros_like(from_rest)
        for k in range(1, len(v)):
            v[k] = from_rest[k - 1] + carries_on @ v[k - 1]
        return v

    def path(self, qd: Array, wrench: Array) -> Array:
        """Returns where the arm goes in an episode (n + 1, 6), from rest on.

        Args:
            qd: (n + 1, 6) commanded coordinates.
            wrench: (n + 1, 6) measured on the bolt, [f; tau] at Bo in Gn.
        """
        found = np.zeros((len(qd), 12))
        found[0, :6] = qd[0]
        for k in range(1, len(qd)):
            last = np.s_[None, k - 1 : k + 1]
            found[k] = self._ahead(found[None, k - 1], qd[last], wrench[last])
        return found[:, :6]

    def _ahead(self, x: Array, qd: Array, wrench: Array) -> Array:
        """Returns coordinates and rates (n, 12) a step after others; see `after`."""
        h = self.step.h
        commanded = np.hstack([qd[:, 1], (qd[:, 1] - qd[:, 0]) / h])
        force = (wrench @ self.to_grip.T)[..., list(AXIS_ORDER)]
        grows = (force[:, 1] - force[:, 0]) / h
        ahead = self.step.ahead(x, commanded)
        return np.asarray(ahead + force[:, 0] @ self.step.G.T + grows @ self.step.H.T)
