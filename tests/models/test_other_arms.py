"""Holds UR5e and Panda against their makers' tables (see models/SOURCES.md)."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.multibody.plant import MultibodyPlant

from drake_disasm.cell.arm_model import ArmModel, add_arm
from drake_disasm.scenario import load_scenario


class Sheet(NamedTuple):
    """What a maker states, per joint; masses are of the links that they move."""

    a: Sequence[float]
    alpha: Sequence[float]
    d: Sequence[float]
    is_craig: bool  # a and alpha come before the joint, not behind it
    X_WBase: RigidTransform
    beyond: float  # m, from the last joint's frame to the flange
    low: Sequence[float]
    high: Sequence[float]
    velocity: Sequence[float]
    effort: Sequence[float]
    mass: Sequence[float]


_H, _TURN = np.pi / 2, 2 * np.pi
SHEETS = {
    "ur5e_removal": Sheet(
        a=[0, -0.425, -0.3922, 0, 0, 0],
        alpha=[_H, 0, 0, _H, -_H, 0],
        d=[0.1625, 0, 0, 0.1333, 0.0997, 0.0996],
        is_craig=False,
        X_WBase=RigidTransform(RollPitchYaw(0, 0, np.pi), [0, 0, 0]),
        beyond=0.0,
        low=[-_TURN, -_TURN, -np.pi, -_TURN, -_TURN, -_TURN],
        high=[_TURN, _TURN, np.pi, _TURN, _TURN, _TURN],
        velocity=[np.pi] * 6,
        effort=[150, 150, 150, 28, 28, 28],
        mass=[3.761, 8.058, 2.846, 1.37, 1.3, 0.365],
    ),
    "panda_removal": Sheet(
        a=[0, 0, 0, 0.0825, -0.0825, 0, 0.088],
        alpha=[0, -_H, _H, _H, -_H, _H, _H],
        d=[0.333, 0, 0.316, 0, 0.384, 0, 0],
        is_craig=True,
        X_WBase=RigidTransform(),
        beyond=0.107,
        low=[-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973],
        high=[2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973],
        velocity=[2.175] * 4 + [2.61] * 3,
        effort=[87] * 4 + [12] * 3,
        mass=[4.970684, 0.646926, 3.228604, 3.587895, 1.225946, 1.666555, 0.735522],
    ),
}


@pytest.fixture(scope="module", params=SHEETS)
def arm(request: pytest.FixtureRequest) -> tuple[Sheet, MultibodyPlant, ArmModel]:
    plant = MultibodyPlant(0.0)
    model = add_arm(plant, load_scenario(request.param).arm)
    plant.Finalize()
    return SHEETS[request.param], plant, model


def _flange_pose(sheet: Sheet, q: np.ndarray) -> RigidTransform:
    """Denavit and Hartenberg's, or Craig's in "Introduction to Robotics"."""
    X = sheet.X_WBase
    for a, alpha, d, angle in zip(sheet.a, sheet.alpha, sheet.d, q, strict=True):
        along = RigidTransform(RollPitchYaw(0, 0, angle), [0, 0, d])
        across = RigidTransform(RollPitchYaw(alpha, 0, 0), [a, 0, 0])
        X = X @ across @ along if sheet.is_craig else X @ along @ across
    return X @ RigidTransform([0, 0, sheet.beyond])


def test_the_flange_is_where_the_makers_table_has_it(arm) -> None:
    sheet, plant, model = arm
    context = plant.CreateDefaultContext()
    for q in np.random.default_rng(0).uniform(
        sheet.low, sheet.high, (20, len(sheet.d))
    ):
        plant.SetPositions(context, q)
        X_WF = model.frame_F.CalcPoseInWorld(context)
        assert X_WF.IsNearlyEqualTo(_flange_pose(sheet, q), 1e-9)


def test_limits_and_masses_are_the_makers(arm) -> None:
    sheet, plant, model = arm
    np.testing.assert_allclose(plant.GetPositionLowerLimits(), sheet.low)
    np.testing.assert_allclose(plant.GetPositionUpperLimits(), sheet.high)
    np.testing.assert_allclose(plant.GetVelocityUpperLimits(), sheet.velocity)
    joints = [plant.GetJointByName(name) for name in model.joints]
    drives = [plant.GetJointActuatorByName(name) for name in model.joints]
    assert [drive.effort_limit() for drive in drives] == sheet.effort
    assert [joint.child_body().default_mass() for joint in joints] == sheet.mass
    assert not model.has_assumed_drives
