"""What the arm's posture along the way changes of a step that the twin takes at A."""

import dataclasses
from typing import Self

import numpy as np
from pydrake.math import RigidTransform

from drake_disasm.cell.grip import AXIS_ORDER
from drake_disasm.cell.twin_parameters import twin_of
from drake_disasm.common.spatial import rotation_from_vector, velocity_shift
from drake_disasm.scenario import Scenario
from drake_disasm.twin.arm_step import ArmStep
from drake_disasm.twin.steps import Steps
from sysid.models.base import Array


@dataclasses.dataclass(frozen=True)
class ArmPosture:
    """How the arm's step changes along the first stage of a part, to first order.

    A twin's arm keeps the inertia, damping and stiffness that it has at A, seen from
    the pads. Farther along it yields more or less to the same load: by a sixth over
    the 60 mm of the door chain's groove.

    Attributes:
        axis: of G, of the stage.
        end: where it ends [m, rad].
        at_A, at_end: a step of the task of the twin's arm.
        to_grip: (6, 6) wrench at the pads by that on the bolt at Bo, in Gn.
    """

    axis: int
    end: float
    at_A: ArmStep
    at_end: ArmStep
    to_grip: Array

    @classmethod
    def of(cls, scenario: Scenario) -> Self:
        """Returns that of a scenario's arm, control and part."""
        stage = scenario.part.stages[0]
        twins = [twin_of(scenario, _pose(stage.axis, way)) for way in (0.0, stage.end)]
        at_A, at_end = (
            ArmStep.of(twin.arm, twin.grip, scenario.task.period) for twin in twins
        )
        to_grip = velocity_shift(twins[0].p_BoTo_B).T
        return cls(stage.axis, stage.end, at_A, at_end, to_grip)

    def moves(self, steps: Steps, places: Array, load: Array) -> Array:
        """Returns by how much coordinates (n, 6) after steps are elsewhere.

        Args:
            steps: n of them.
            places: (n, 6) of the bolt, position and rotation vector in G.
            load: (n, 6) on the bolt in the step, [f; tau] at Bo in Gn.
        """
        begin = np.hstack([steps.q, steps.v])
        end = steps.qd + self.at_A.h * steps.qd_rate
        command = np.hstack([end, steps.qd_rate])
        force = (load @ self.to_grip.T)[:, list(AXIS_ORDER)]
        at_A, at_end = (
            (own.ahead(begin, command) + force @ own.G.T)[:, :6]
            for own in (self.at_A, self.at_end)
        )
        return np.asarray(places[:, self.axis, None] / self.end * (at_end - at_A))


def _pose(axis: int, way: float) -> RigidTransform:
    """Returns the bolt's pose in G along or about an axis."""
    p, turn = np.split(way * np.eye(6)[axis], 2)
    return RigidTransform(rotation_from_vector(turn), p)
