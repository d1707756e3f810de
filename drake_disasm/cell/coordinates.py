"""Station coordinates against the bolt's pose: the arm's joints, or the twin's.

The rest of the diagram speaks of X_GB, the bolt in the groove's nominal frame;
what a station is commanded with is a vector of coordinates. One object per
station maps both ways, so pose targets and observations need not know which.
"""

import abc

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.inverse_kinematics import (
    DifferentialInverseKinematicsParameters,
    DifferentialInverseKinematicsStatus,
    DoDifferentialInverseKinematics,
    InverseKinematics,
)
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame
from pydrake.solvers import Solve

from drake_disasm.cell.arm_description import per_joint
from drake_disasm.cell.arm_dynamics import add_frames, bolt_jacobian
from drake_disasm.cell.arm_model import add_arm
from drake_disasm.common.arrays import Array, apply_matrix, namespace
from drake_disasm.common.errors import DisasmError, UnreachableError
from drake_disasm.common.rotations import Pose, matrices_of_turns, turns_of_matrices
from drake_disasm.common.spatial import rotation_vector
from drake_disasm.scenario import ArmConfig

_ZERO = np.zeros(3)
_TOLERANCE = 1e-5  # m, of inverse kinematics
_TURN_TOLERANCE = 1e-4  # rad, of the same
_LENGTH = 0.3  # m, of a bolt's lever by which rotations count as displacements
_LEAST_REACH = 0.03  # m/rad, of the bolt by the joints in its hardest direction
_SOLUTION = DifferentialInverseKinematicsStatus.kSolutionFound


class Coordinates(abc.ABC):
    """Maps a station's coordinates to the bolt's pose and back."""

    size: int

    @abc.abstractmethod
    def pose(self, coordinates: np.ndarray) -> RigidTransform:
        """Returns X_GB of coordinates (size,)."""

    @abc.abstractmethod
    def solve(self, X_GB: RigidTransform, near: np.ndarray) -> np.ndarray:
        """Returns the coordinates (size,) of a pose close to that of `near`."""


class BoltCoordinates(Coordinates):
    """The twin's joints: x, y, z [m], then turns about z, x, y [rad], of B in Gn.

    Args:
        p_BoTo_B: (3,), or (n, 3), point of the bolt that x, y, z are displacements
            of [m].
    """

    size = 6

    def __init__(self, p_BoTo_B: Array = _ZERO) -> None:
        self._p_BoTo_B = p_BoTo_B

    def pose(self, coordinates: np.ndarray) -> RigidTransform:
        """See Coordinates."""
        return self.poses(coordinates).to_drake()

    def poses(self, coordinates: Array) -> Pose:
        """Returns X_GB of coordinates (..., 6), in NumPy or torch."""
        R = matrices_of_turns(coordinates[..., 3:])
        p_BoTo = apply_matrix(R, self._p_BoTo_B)
        return Pose(R, coordinates[..., :3] + self._p_BoTo_B - p_BoTo)

    def solve(self, X_GB: RigidTransform, near: np.ndarray) -> np.ndarray:
        """See Coordinates; exact, `near` is not needed."""
        return np.asarray(self.of_poses(Pose.of(X_GB)))

    def of_poses(self, X_GB: Pose) -> Array:
        """Returns the coordinates (..., 6) of poses."""
        xp = namespace(X_GB.p)
        p = X_GB.p + apply_matrix(X_GB.R, self._p_BoTo_B) - self._p_BoTo_B
        return xp.concat([p, turns_of_matrices(X_GB.R)], axis=-1)


class ArmCoordinates(Coordinates):
    """The arm's joint angles [rad]; poses by Drake's differential IK.

    Args:
        arm: the arm's configuration.
        X_WG: nominal groove frame.
        X_FB: bolt in the flange frame, as grasped.
        period: time that one step of motion may take [s], for velocity limits.
    """

    def __init__(
        self, arm: ArmConfig, X_WG: RigidTransform, X_FB: RigidTransform, period: float
    ) -> None:
        self._X_WG = X_WG
        self._plant, self._frame_B, self._frame_G = _arm_alone(arm, X_FB, X_WG)
        self._context = self._plant.CreateDefaultContext()
        self.size = self._plant.num_positions()
        self._posture = per_joint(arm.posture, self.size, "arm.posture")
        self._refuse_posture_beyond_limits()
        self._parameters = self._differential_ik_parameters(period)

    def pose(self, coordinates: np.ndarray) -> RigidTransform:
        """See Coordinates."""
        self._plant.SetPositions(self._context, coordinates)
        return self._frame_B.CalcPose(self._context, self._frame_G)

    def solve(self, X_GB: RigidTransform, near: np.ndarray) -> np.ndarray:
        """See Coordinates.

        Raises:
            DisasmError: no joint motion within the limits goes there.
        """
        q = near
        for _ in range(2):  # the second step removes the first one's curvature
            self._plant.SetPositions(self._context, q)
            result = DoDifferentialInverseKinematics(
                self._plant,
                self._context,
                self._X_WG @ X_GB,
                self._frame_B,
                self._parameters,
            )
            if result.status != _SOLUTION:
                break
            q = q + self._parameters.get_time_step() * result.joint_velocities
        self._refuse_a_miss(X_GB, self.pose(q))
        return q

    def _refuse_a_miss(self, wanted: RigidTransform, reached: RigidTransform) -> None:
        miss = np.linalg.norm(reached.translation() - wanted.translation())
        R = wanted.rotation().inverse() @ reached.rotation()
        turn = np.linalg.norm(rotation_vector(R))
        if miss > _TOLERANCE or turn > _TURN_TOLERANCE:
            raise UnreachableError(
                f"the arm can't follow the command within its limits (off by "
                f"{1e3 * miss:.2f} mm and {np.rad2deg(turn):.2f} degrees); "
                "move the lock by placement.p_WG"
            )

    def start(self, X_GB: RigidTransform) -> np.ndarray:
        """Returns joint angles for a pose, as near the preferred posture as can be.

        Raises:
            DisasmError: the pose is out of reach, or the arm is nearly singular there.
        """
        X_WB = self._X_WG @ X_GB
        ik = InverseKinematics(self._plant)
        world = self._plant.world_frame()
        p = X_WB.translation()
        ik.AddPositionConstraint(self._frame_B, np.zeros(3), world, p, p)
        ik.AddOrientationConstraint(
            world, X_WB.rotation(), self._frame_B, RotationMatrix(), 1e-4
        )
        ik.prog().AddQuadraticErrorCost(np.eye(self.size), self._posture, ik.q())
        result = Solve(ik.prog(), self._posture)
        if not result.is_success():
            raise DisasmError(
                f"the arm can't reach the lock at {np.round(p, 3)} m from arm.posture; "
                "move it by placement.p_WG, or give another posture"
            )
        # Polished to rounding error: the solver stops at its own tolerance.
        q = self.solve(X_GB, result.GetSolution(ik.q()))
        self._refuse_near_singular(q)
        return q

    def _refuse_posture_beyond_limits(self) -> None:
        low = self._plant.GetPositionLowerLimits()
        high = self._plant.GetPositionUpperLimits()
        for i in np.flatnonzero((self._posture < low) | (self._posture > high)):
            names = self._plant.GetPositionNames(add_model_instance_prefix=False)
            joint, value = names[i].removesuffix("_q"), self._posture[i]
            raise DisasmError(
                f"arm.posture: {value:g} rad of {joint} is beyond its limits; give a "
                f"value from {low[i]:g} to {high[i]:g}"
            )

    def _refuse_near_singular(self, q: np.ndarray) -> None:
        """Refuses joint angles from which some motion of the bolt takes too much."""
        J = self.jacobian(q)
        J[3:] *= _LENGTH
        least = np.linalg.svd(J, compute_uv=False)[-1]
        if least < _LEAST_REACH:
            raise DisasmError(
                "arm.posture: the arm is nearly singular at the start: 1 rad of its "
                f"joints moves the bolt by {1e3 * least:.0f} mm in one direction, and "
                f"{1e3 * _LEAST_REACH:.0f} are needed; give a posture with bent elbow "
                "and wrist, or move the lock by placement.p_WG"
            )

    def stiffness(self, joint_stiffness: np.ndarray, q: np.ndarray) -> np.ndarray:
        """Returns the 6x6 stiffness at Bo in G, [translation; rotation] order.

        K = (J diag(k)^-1 J^T)^-1, the joints being springs in series.
        """
        J = self.jacobian(q)
        return np.linalg.inv(J @ np.diag(1.0 / joint_stiffness) @ J.T)

    def jacobian(self, q: np.ndarray) -> np.ndarray:
        """Returns the Jacobian (6, n) at Bo in Gn, [translation; rotation]."""
        self._plant.SetPositions(self._context, q)
        return bolt_jacobian(self._plant, self._context, self._frame_B, self._frame_G)

    def _differential_ik_parameters(
        self, period: float
    ) -> DifferentialInverseKinematicsParameters:
        plant = self._plant
        parameters = DifferentialInverseKinematicsParameters(
            plant.num_positions(), plant.num_velocities()
        )
        parameters.set_time_step(period)
        parameters.set_nominal_joint_position(self._posture)
        parameters.set_joint_position_limits(
            (plant.GetPositionLowerLimits(), plant.GetPositionUpperLimits())
        )
        parameters.set_joint_velocity_limits(
            (plant.GetVelocityLowerLimits(), plant.GetVelocityUpperLimits())
        )
        return parameters


def _arm_alone(
    arm: ArmConfig, X_FB: RigidTransform, X_WG: RigidTransform
) -> tuple[MultibodyPlant, Frame, Frame]:
    """Returns a plant with the arm, and its frames B and Gn."""
    plant = MultibodyPlant(0.0)
    flange = add_arm(plant, arm).frame_F
    frames = add_frames(plant, flange, X_FB, X_WG)
    plant.Finalize()
    return plant, *frames
