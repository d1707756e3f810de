"""Observation processing: exact for any pose, and near the thesis's form."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix

from drake_disasm.common.spatial import weight_wrench
from drake_disasm.systems.observation import (
    Mounting,
    contact_wrench,
    small_angle_contact_wrench,
)

G_W = np.array([0.0, 0.0, -9.81])
R_WG = RollPitchYaw(np.pi / 2, 0.0, 0.3).ToRotationMatrix()  # y_G up
R_SB = RotationMatrix(np.array([[-1.0, 0, 0], [0, 0, -1.0], [0, -1.0, 0]]))
WEIGHT, L1, L2 = 10.06, 0.07, 0.26  # N, m, m: the thesis's tool, our own distance
ON_AXIS = Mounting(
    RigidTransform(R_SB, [0, 0, L2]), R_WG, WEIGHT / 9.81, np.array([0, 0, L1]), G_W
)


def _random_mounting(generator: np.random.Generator) -> Mounting:
    rpy = RollPitchYaw(generator.uniform(-3, 3, 3) * [1, 0.5, 1])
    p_SoBo_S, p_SoScm_S = generator.uniform(-0.3, 0.3, (2, 3))
    return Mounting(RigidTransform(rpy, p_SoBo_S), R_WG, 1.4, p_SoScm_S, G_W)


def _reading(
    wrench_G: np.ndarray, R_GB: RotationMatrix, mounting: Mounting
) -> np.ndarray:
    """What the sensor reads under a wrench at Bo in G, from first principles."""
    R_GS = R_GB @ mounting.X_SB.rotation().inverse()
    R_WS = mounting.R_WG @ R_GS
    p_BoSo_G = -(R_GS @ mounting.X_SB.translation())
    f_G, t_Bo_G = wrench_G[:3], wrench_G[3:]
    t_So_G = t_Bo_G + np.cross(-p_BoSo_G, f_G)
    R_SG = R_GS.inverse()
    weight = weight_wrench(mounting.mass, mounting.p_SoScm_S, R_WS.matrix(), G_W)
    return np.concatenate([R_SG @ f_G, R_SG @ t_So_G]) + weight


@pytest.mark.parametrize("seed", range(8))
def test_exact_recovers_the_contact_wrench(seed: int) -> None:
    generator = np.random.default_rng(seed)
    mounting = _random_mounting(generator)
    R_GB = RollPitchYaw(generator.uniform(-1.5, 1.5, 3)).ToRotationMatrix()
    wrench, offset = generator.normal(size=(2, 6))
    reading = _reading(wrench, R_GB, mounting) + offset
    found = contact_wrench(reading, offset, R_GB, mounting)
    np.testing.assert_allclose(found, wrench, atol=1e-12)


def _small_angle_error(angle: float, wrench: np.ndarray) -> np.ndarray:
    """The thesis's form minus the truth, turned by `angle` about x and z."""
    R_GB = RollPitchYaw(angle, 0.0, angle).ToRotationMatrix()
    tare = _reading(np.zeros(6), RotationMatrix(), ON_AXIS)
    reading = _reading(wrench, R_GB, ON_AXIS)
    return small_angle_contact_wrench(reading, tare, R_GB, ON_AXIS) - wrench


def test_small_angle_form_is_exact_upright() -> None:
    wrench = np.array([1.0, -2.0, 3.0, 0.1, 0.2, -0.3])
    np.testing.assert_allclose(_small_angle_error(0.0, wrench), 0.0, atol=1e-12)


@pytest.mark.parametrize("degrees", [0.5, 1.0, 2.0, 5.0])
def test_small_angle_form_misses_gravity_by_second_order(degrees: float) -> None:
    """Without contact: at most G angle^2 in force, l times that in torque."""
    angle = np.deg2rad(degrees)
    error = _small_angle_error(angle, np.zeros(6))
    assert np.abs(error[:3]).max() < WEIGHT * angle**2
    assert np.abs(error[3:]).max() < (L1 + L2) * WEIGHT * angle**2
    assert np.abs(error).max() > 0.0


def test_small_angle_form_ignores_the_turning_of_the_wrench() -> None:
    """With contact the error is first order: the wrench is not turned back."""
    wrench, angle = np.array([0, 5.0, 0, 0, 0, 0]), np.deg2rad(2.0)
    error = _small_angle_error(angle, wrench)
    assert 0.5 * 5.0 * angle < np.abs(error[:3]).max() < 3.0 * 5.0 * angle


def test_small_angle_form_fails_at_30_degrees() -> None:
    assert np.abs(_small_angle_error(np.deg2rad(30), np.zeros(6))[:3]).max() > 0.5
