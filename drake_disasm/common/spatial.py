"""Rotation vectors, and wrenches in the vendor's order [f; tau]."""

import math

import numpy as np
from pydrake.common.eigen_geometry import AngleAxis, Quaternion
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.math import SpatialForce

from drake_disasm.common.arrays import (
    Array,
    apply_matrix,
    cross,
    namespace,
    transposed,
)


def rotation_from_vector(vector: np.ndarray) -> RotationMatrix:
    """Returns Exp(vector): a turn about `vector` (3,) by its length [rad]."""
    angle = math.sqrt(vector @ vector)
    if angle == 0.0:
        return RotationMatrix()
    return RotationMatrix(AngleAxis(angle, vector / angle))


def rotation_vector(R: RotationMatrix) -> np.ndarray:
    """Returns Log(R), (3,) [rad], the inverse of `rotation_from_vector`."""
    angle_axis = R.ToAngleAxis()
    return angle_axis.angle() * angle_axis.axis()


def wrench_from_spatial_force(F: SpatialForce) -> np.ndarray:
    """Returns Drake's [tau; f] as the sensor's and observation's [f; tau], (6,)."""
    return np.concatenate([F.translational(), F.rotational()])


def shift_and_express(wrench_So_S: np.ndarray, X_AS: RigidTransform) -> np.ndarray:
    """Returns a wrench at Ao expressed in A from the same wrench at So in S.

    Args:
        wrench_So_S: (6,) [f; tau] at So, expressed in S.
        X_AS: pose of S in A.
    """
    return shifted_wrench(wrench_So_S, X_AS.rotation().matrix(), X_AS.translation())


def shifted_wrench(wrench: Array, R: Array, p: Array) -> Array:
    """Returns wrenches at Ao in A from the same at So in S, (..., 6) [f; tau].

    Args:
        wrench: (..., 6) at So, expressed in S.
        R: (..., 3, 3) of S in A.
        p: (..., 3) of So in A [m].
    """
    f, t = apply_matrix(R, wrench[..., :3]), apply_matrix(R, wrench[..., 3:])
    return namespace(f).concat([f, t + cross(p, f)], axis=-1)


def weight_wrench(
    mass: float | Array, p_SoScm_S: Array, R_WS: Array, g_W: Array
) -> Array:
    """Returns what a hanging mass loads the sensor with, (..., 6) [f; tau] in S.

    Args:
        mass: [kg]; (..., 1) where each has its own.
        p_SoScm_S: (..., 3) its centre of mass from So, about which the torque is [m].
        R_WS: (..., 3, 3) orientations of the sensor.
        g_W: (..., 3) gravity [m/s^2].
    """
    f = mass * apply_matrix(transposed(R_WS), g_W)
    return namespace(f).concat([f, cross(p_SoScm_S, f)], axis=-1)


def skew(a: np.ndarray) -> np.ndarray:
    """Returns [a]x (3, 3): skew(a) @ b is the cross product of a and b, (3,) each."""
    x, y, z = a
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def velocity_shift(p: np.ndarray) -> np.ndarray:
    """Returns (6, 6): [v; w] at a point of a body by that at another, p (3,) from it.

    Small displacements and rotations shift likewise; its transpose shifts wrenches
    from the first point to the other.
    """
    shift = np.eye(6)
    shift[:3, 3:] = skew(p)
    return shift


def pose_to_vector(X: RigidTransform) -> np.ndarray:
    """Returns [x, y, z, qw, qx, qy, qz] with qw >= 0, (7,)."""
    wxyz = X.rotation().ToQuaternion().wxyz()
    return np.concatenate([X.translation(), np.copysign(1.0, wxyz[0]) * wxyz])


def pose_from_vector(vector: np.ndarray) -> RigidTransform:
    """Returns the pose of [x, y, z, qw, qx, qy, qz] (7,)."""
    wxyz = vector[3:]
    return RigidTransform(Quaternion(wxyz / math.sqrt(wxyz @ wxyz)), vector[:3])
