"""Rotation vectors, poses and wrenches against closed forms."""

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from pydrake.multibody.math import SpatialForce

from drake_disasm.common.spatial import (
    pose_from_vector,
    pose_to_vector,
    rotation_from_vector,
    rotation_vector,
    shift_and_express,
    weight_wrench,
    wrench_from_spatial_force,
)


def _rodrigues(vector: np.ndarray) -> np.ndarray:
    """Exp(vector) as a matrix, by Rodrigues' formula."""
    angle = np.linalg.norm(vector)
    x, y, z = vector / angle
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


@pytest.mark.parametrize("angle", [1e-9, 1e-3, 1.0, 3.1])
def test_rotation_vector_is_the_inverse_of_exp(angle: float) -> None:
    axis = np.random.default_rng(0).normal(size=3)
    vector = angle * axis / np.linalg.norm(axis)
    R = rotation_from_vector(vector)
    np.testing.assert_allclose(R.matrix(), _rodrigues(vector), atol=1e-14)
    np.testing.assert_allclose(rotation_vector(R), vector, atol=1e-12)


def test_zero_is_the_identity_exactly() -> None:
    assert rotation_from_vector(np.zeros(3)).IsExactlyIdentity()
    np.testing.assert_array_equal(rotation_vector(RotationMatrix()), np.zeros(3))


def test_wrench_order_and_shift_by_a_lever() -> None:
    """10 N up at the end of a lever of 0.2 m along x, seen from its foot."""
    F = SpatialForce(tau=[1, 2, 3], f=[4, 5, 6])
    np.testing.assert_array_equal(wrench_from_spatial_force(F), [4, 5, 6, 1, 2, 3])
    R_AS = RotationMatrix.MakeXRotation(np.pi / 2)  # y_S is z_A
    wrench = shift_and_express(
        np.array([0, 10.0, 0, 0, 0.5, 0]), RigidTransform(R_AS, [0.2, 0, 0])
    )
    np.testing.assert_allclose(wrench, [0, 0, 10, 0, -2.0, 0.5], atol=1e-14)


def test_shift_keeps_the_power() -> None:
    """A wrench does the same work on a moving body wherever it is expressed."""
    generator = np.random.default_rng(0)
    wrench_S, twist_A = generator.normal(size=(2, 6))  # twist: [v; w] at Ao in A
    rpy, p_AoSo_A = generator.normal(size=(2, 3))
    X_AS = RigidTransform(RollPitchYaw(rpy), p_AoSo_A)
    R_SA = X_AS.rotation().inverse().matrix()
    v_So_A = twist_A[:3] + np.cross(twist_A[3:], p_AoSo_A)
    twist_S = np.concatenate([R_SA @ v_So_A, R_SA @ twist_A[3:]])
    power = shift_and_express(wrench_S, X_AS) @ twist_A
    assert power == pytest.approx(wrench_S @ twist_S, rel=1e-12)


def test_weight_pulls_down_through_the_centre_of_mass() -> None:
    generator = np.random.default_rng(0)
    rpy, p_SoScm_S = generator.normal(size=(2, 3))
    R_WS = RollPitchYaw(rpy).ToRotationMatrix()
    wrench = weight_wrench(2.0, p_SoScm_S, R_WS.matrix(), np.array([0, 0, -9.81]))
    np.testing.assert_allclose(R_WS @ wrench[:3], [0, 0, -19.62], atol=1e-12)
    p_W = R_WS @ p_SoScm_S  # torque about z_W is none, about x and y: m g times arm
    expected = 19.62 * np.array([-p_W[1], p_W[0], 0])
    np.testing.assert_allclose(R_WS @ wrench[3:], expected, atol=1e-12)


@pytest.mark.parametrize("angle", [0.0, 1.0, 3.3])
def test_pose_vector_round_trips_with_positive_w(angle: float) -> None:
    X = RigidTransform(rotation_from_vector(angle * np.array([0, 0.6, 0.8])), [1, 2, 3])
    vector = pose_to_vector(X)
    assert vector.shape == (7,)
    assert vector[3] >= 0.0
    assert np.linalg.norm(vector[3:]) == pytest.approx(1.0)
    assert pose_from_vector(vector).IsNearlyEqualTo(X, 1e-14)
    X = pose_from_vector(np.array([0, 0, 0, 2.0, 0, 0, 2.0]))
    quarter = RotationMatrix.MakeZRotation(np.pi / 2)
    np.testing.assert_allclose(X.rotation().matrix(), quarter.matrix(), atol=1e-14)
