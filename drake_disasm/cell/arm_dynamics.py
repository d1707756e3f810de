"""Arm and tool as the robot's own controller knows them: rigid and free."""

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    Frame,
    JacobianWrtVariable,
    SpatialInertia,
)
from pydrake.systems.framework import Context

from drake_disasm.cell.arm_model import add_arm
from drake_disasm.cell.tool import Tool
from drake_disasm.scenario import ArmConfig


class ArmDynamics:
    """Kinematics and inertia of arm and tool, the bolt held fast, at joint angles.

    Each method answers for the joint angles that `set_positions` was last given.

    Attributes:
        plant: arm and tool, without a time step.

    Args:
        arm: whose model is read.
        tool: its mass, and where the bolt is in it.
        X_WG: nominal groove frame.
        M_F: inertia on the flange, about Fo in F; None is all of the tool's.
    """

    def __init__(
        self,
        arm: ArmConfig,
        tool: Tool,
        X_WG: RigidTransform,
        M_F: SpatialInertia | None = None,
    ) -> None:
        self.plant = MultibodyPlant(0.0)
        model = add_arm(self.plant, arm)
        self._instance, flange = model.instance, model.frame_F
        instance = self.plant.AddModelInstance("tool")
        load = self.plant.AddRigidBody("tool", instance, M_F or tool.M_F)
        self.plant.WeldFrames(flange, load.body_frame())
        self._frame_B, self._frame_G = add_frames(self.plant, flange, tool.X_FB, X_WG)
        self.plant.Finalize()
        self._context = self.plant.CreateDefaultContext()

    def set_positions(self, q: np.ndarray) -> None:
        """Goes to joint angles (n,) [rad]."""
        self.plant.SetPositions(self._context, q)

    def pose(self) -> RigidTransform:
        """Returns X_GB."""
        return self._frame_B.CalcPose(self._context, self._frame_G)

    def jacobian(self) -> np.ndarray:
        """Returns the Jacobian (6, n) at Bo in Gn, [translation; rotation]."""
        return bolt_jacobian(self.plant, self._context, self._frame_B, self._frame_G)

    def mass_matrix(self) -> np.ndarray:
        """Returns the mass matrix (n, n), rotors included [kg m^2]."""
        return np.asarray(self.plant.CalcMassMatrix(self._context))

    def joint_damping(self) -> np.ndarray:
        """Returns the damping of the joints themselves (n,) [N m s/rad]."""
        joints = self.plant.GetJointIndices(self._instance)
        moving = [j for j in map(self.plant.get_joint, joints) if j.num_velocities()]
        moving.sort(key=lambda joint: joint.velocity_start())
        return np.array([joint.default_damping() for joint in moving])

    def bolt_inertia(self) -> np.ndarray:
        """Returns Lambda = (J M^-1 J^T)^-1 (6, 6): inertia at Bo in Gn.

        What a force on the bolt would move, [translation; rotation] (Khatib, "A
        unified approach for motion and force control of robot manipulators", 1987).
        """
        J = self.jacobian()
        return np.linalg.inv(J @ np.linalg.solve(self.mass_matrix(), J.T))


def add_frames(
    plant: MultibodyPlant, flange: Frame, X_FB: RigidTransform, X_WG: RigidTransform
) -> tuple[Frame, Frame]:
    """Returns frames B of the bolt, as grasped, and Gn of the groove, both added."""
    frame_B = plant.AddFrame(FixedOffsetFrame("bolt", flange, X_FB))
    groove = FixedOffsetFrame("groove_nominal", plant.world_frame(), X_WG)
    return frame_B, plant.AddFrame(groove)


def bolt_jacobian(
    plant: MultibodyPlant, context: Context, frame_B: Frame, frame_G: Frame
) -> np.ndarray:
    """Returns the Jacobian of all velocities at Bo in Gn, [translation; rotation].

    Args:
        plant: with the arm.
        context: of the plant, with its positions.
        frame_B, frame_G: see `add_frames`.
    """
    J = plant.CalcJacobianSpatialVelocity(
        context,
        JacobianWrtVariable.kV,
        frame_B,
        np.zeros(3),
        plant.world_frame(),
        frame_G,
    )
    return np.asarray(J[[3, 4, 5, 0, 1, 2]])
