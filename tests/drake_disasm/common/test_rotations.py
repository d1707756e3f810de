"""Rotations as arrays, against Drake's of one."""

import numpy as np
import pytest
import torch
from pydrake.math import RigidTransform, RollPitchYaw
from scipy.spatial.transform import Rotation

from drake_disasm.common import rotations
from drake_disasm.common.arrays import array_like, to_numpy
from drake_disasm.common.spatial import rotation_from_vector, rotation_vector

RANDOM = np.random.default_rng(1)
VECTORS = np.concatenate(
    [
        RANDOM.normal(size=(20, 3)),
        1e-3 * RANDOM.normal(size=(5, 3)),
        1e-6 * RANDOM.normal(size=(5, 3)),
        np.zeros((1, 3)),
        [[0.0, 3.0, 0.0], [1e-4, 0.0, 0.0]],
    ]
)
KINDS = [np.zeros(0), torch.zeros(0, dtype=torch.float64)]
both = pytest.mark.parametrize("like", KINDS, ids=["numpy", "torch"])


@both
def test_exponential_and_logarithm_are_drakes(like):
    R = rotations.rotation_matrices(array_like(VECTORS, like))
    found, back = to_numpy(R), to_numpy(rotations.rotation_vectors(R))
    for vector, matrix, again in zip(VECTORS, found, back, strict=True):
        expected = rotation_from_vector(vector)
        np.testing.assert_allclose(matrix, expected.matrix(), atol=1e-14)
        np.testing.assert_allclose(again, rotation_vector(expected), atol=1e-9)


def test_one_pose_of_numpy_is_drakes_own() -> None:
    assert np.array_equal(
        rotations.rotation_matrices(np.zeros((2, 3))), [np.eye(3)] * 2
    )
    X = rotations.pose_from_vectors(
        np.array([0.1, 0.2, 0.3]), np.array([1.0, 2.0, 3.0])
    )
    assert isinstance(X, RigidTransform)
    assert rotations.Pose.of(X).to_drake().IsNearlyEqualTo(X, 1e-15)


@both
def test_roll_pitch_and_yaw_are_drakes(like):
    rpy = RANDOM.uniform(-1.5, 1.5, (10, 3))
    R = array_like([RollPitchYaw(one).ToRotationMatrix().matrix() for one in rpy], like)
    np.testing.assert_allclose(to_numpy(rotations.rpy_of_matrices(R)), rpy, atol=1e-12)


@both
def test_turns_are_about_z_then_x_then_y(like):
    turns = RANDOM.uniform(-1.5, 1.5, (10, 3))
    R = rotations.matrices_of_turns(array_like(turns, like))
    expected = Rotation.from_euler("ZXY", turns).as_matrix()
    np.testing.assert_allclose(to_numpy(R), expected, atol=1e-14)
    found = to_numpy(rotations.turns_of_matrices(R))
    np.testing.assert_allclose(found, turns, atol=1e-12)


@both
def test_poses_compose_as_drakes(like):
    turns, p = RANDOM.normal(size=(2, 3)), RANDOM.normal(size=(2, 3))
    one, other = (
        RigidTransform(rotation_from_vector(turns[i]), p[i]) for i in range(2)
    )
    poses = rotations.pose_from_vectors(array_like(turns, like), array_like(p, like))
    first, second = (rotations.Pose(poses.R[i], poses.p[i]) for i in range(2))
    both_ = (one @ other.inverse()).GetAsMatrix34()
    found = first @ second.inverse()
    np.testing.assert_allclose(to_numpy(found.R), both_[:, :3], atol=1e-12)
    np.testing.assert_allclose(to_numpy(found.p), both_[:, 3], atol=1e-12)
    np.testing.assert_allclose(to_numpy(first @ second.p), one @ p[1], atol=1e-12)
