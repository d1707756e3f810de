"""Rotations and poses as arrays of any leading shape, in NumPy or torch.

Drake's own types are for one; `Pose` has the part of `RigidTransform`'s interface that
the equations use, so that one equation serves both.
"""

import dataclasses
from typing import Self

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from drake_disasm.common.arrays import (
    Array,
    apply_matrix,
    array_like,
    matrix_of,
    namespace,
    side_by_side,
    transposed,
)
from drake_disasm.common.spatial import rotation_from_vector

_SMALL = 1e-4  # rad, below which series are exact to rounding


def as_matrices(R: RotationMatrix | Array) -> Array:
    """Returns Drake's rotation as a matrix (3, 3), matrices as they are."""
    return R.matrix() if isinstance(R, RotationMatrix) else R


def rotation_matrices(vectors: Array) -> Array:
    """Returns Exp(vectors): matrices (..., 3, 3) of rotation vectors (..., 3) [rad].

    Rodrigues' formula; the identity bit for bit where a vector is zero.
    """
    xp = namespace(vectors)
    squared = xp.sum(vectors * vectors, axis=-1)
    is_small = squared < _SMALL**2
    angle = xp.sqrt(xp.where(is_small, 1.0, squared))
    one = xp.where(is_small, 1.0 - squared / 6.0, xp.sin(angle) / angle)
    half = xp.sin(angle / 2.0) / angle
    two = xp.where(is_small, 0.5 - squared / 24.0, 2.0 * half * half)
    K = cross_matrices(vectors)
    identity = array_like(np.eye(3), vectors)
    return identity + one[..., None, None] * K + two[..., None, None] * xp.matmul(K, K)


def cross_matrices(vectors: Array) -> Array:
    """Returns [a]x (..., 3, 3) of vectors (..., 3)."""
    x, y, z = (vectors[..., i] for i in range(3))
    zero = namespace(vectors).zeros_like(x)
    return matrix_of([[zero, -z, y], [z, zero, -x], [-y, x, zero]])


def rotation_vectors(R: Array) -> Array:
    """Returns Log(R), (..., 3) [rad], of matrices whose angles are below pi.

    By the quaternion, whose real part is positive then.
    """
    xp = namespace(R)
    trace = R[..., 0, 0] + R[..., 1, 1] + R[..., 2, 2]
    axial = side_by_side(
        [R[..., j, i] - R[..., i, j] for i, j in ((1, 2), (2, 0), (0, 1))]
    )
    sine = xp.sqrt(xp.sum(axial * axial, axis=-1)) / 2.0
    angle = xp.atan2(sine, (trace - 1.0) / 2.0)
    is_small = angle < _SMALL
    factor = angle / xp.where(is_small, 1.0, sine)
    factor = xp.where(is_small, 1.0 + angle * angle / 6.0, factor) / 2.0
    return factor[..., None] * axial


def matrices_of_turns(turns: Array) -> Array:
    """Returns R (..., 3, 3) = Rz(a) Rx(b) Ry(c) of turns a, b, c (..., 3) [rad]."""
    xp = namespace(turns)
    sines, cosines = xp.sin(turns), xp.cos(turns)
    sz, sx, sy = (sines[..., i] for i in range(3))
    cz, cx, cy = (cosines[..., i] for i in range(3))
    return matrix_of(
        [
            [cz * cy - sz * sx * sy, -sz * cx, cz * sy + sz * sx * cy],
            [sz * cy + cz * sx * sy, cz * cx, sz * sy - cz * sx * cy],
            [-cx * sy, sx, cx * cy],
        ]
    )


def turns_of_matrices(R: Array) -> Array:
    """Returns the turns (..., 3) of R, that about x within a quarter turn [rad]."""
    xp = namespace(R)
    level = xp.sqrt(R[..., 0, 1] ** 2 + R[..., 1, 1] ** 2)
    return side_by_side(
        [
            xp.atan2(-R[..., 0, 1], R[..., 1, 1]),
            xp.atan2(R[..., 2, 1], level),
            xp.atan2(-R[..., 2, 0], R[..., 2, 2]),
        ]
    )


def rpy_of_matrices(R: Array) -> Array:
    """Returns roll, pitch and yaw (..., 3) of R, pitch within a quarter turn."""
    xp = namespace(R)
    level = xp.sqrt(R[..., 0, 0] ** 2 + R[..., 1, 0] ** 2)
    return side_by_side(
        [
            xp.atan2(R[..., 2, 1], R[..., 2, 2]),
            xp.atan2(-R[..., 2, 0], level),
            xp.atan2(R[..., 1, 0], R[..., 0, 0]),
        ]
    )


@dataclasses.dataclass(frozen=True)
class Pose:
    """Poses X_AB of any leading shape.

    Attributes:
        R: (..., 3, 3) orientation of B in A.
        p: (..., 3) origin of B in A [m].
    """

    R: Array
    p: Array

    @classmethod
    def of(cls, X: RigidTransform) -> Self:
        """Returns one of Drake's, in NumPy."""
        return cls(X.rotation().matrix(), X.translation())

    def rotation(self) -> Array:
        """Returns (..., 3, 3)."""
        return self.R

    def translation(self) -> Array:
        """Returns (..., 3) [m]."""
        return self.p

    def to_drake(self) -> RigidTransform:
        """Returns a single pose of NumPy as Drake's."""
        return RigidTransform(RotationMatrix(self.R), self.p)

    def inverse(self) -> "Pose":
        """Returns X_BA."""
        R = transposed(self.R)
        return Pose(R, -apply_matrix(R, self.p))

    def __matmul__(self, other: "Pose | Array") -> "Pose | Array":
        """Returns X_AC of X_BC, or points (..., 3) of B in A."""
        if isinstance(other, Pose):
            xp = namespace(self.R)
            R = xp.matmul(self.R, other.R)
            return Pose(R, apply_matrix(self.R, other.p) + self.p)
        return apply_matrix(self.R, other) + self.p


def pose_from_vectors(turn: Array, p: Array) -> RigidTransform | Pose:
    """Returns the pose (Exp(turn), p); Drake's own if it is one of NumPy.

    Args:
        turn: (..., 3) rotation vector [rad].
        p: (..., 3) [m].
    """
    if isinstance(p, np.ndarray) and turn.ndim == p.ndim == 1:
        return RigidTransform(rotation_from_vector(turn), p)
    return Pose(rotation_matrices(turn), p)
