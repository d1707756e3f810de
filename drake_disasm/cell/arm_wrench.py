"""The wrench on an arm's flange, by the torques in its joints.

Frames: F flange, Fo its origin.
"""

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JacobianWrtVariable, MultibodyForces

from drake_disasm.cell.arm_model import add_arm
from drake_disasm.scenario import ArmConfig


class ArmWrench:
    """An arm without a tool as its controller knows it, for estimates of a wrench.

    Args:
        arm: whose model is read.
    """

    def __init__(self, arm: ArmConfig) -> None:
        self._plant = MultibodyPlant(0.0)
        self._frame_F = add_arm(self._plant, arm).frame_F
        self._plant.Finalize()
        self._context = self._plant.CreateDefaultContext()
        self._forces = MultibodyForces(self._plant)

    def load(
        self, q: np.ndarray, v: np.ndarray, a: np.ndarray, torque: np.ndarray
    ) -> np.ndarray:
        """Returns all that acts on the flange (6,), [f; tau] at Fo in F.

        The torques that the motion takes by the model, less the measured ones, are
        J^T times it.

        Args:
            q, v, a: (n,) of the joints [rad, rad/s, rad/s^2].
            torque: (n,) of the drives, as measured, in Drake's sign [N m].
        """
        plant, context = self._plant, self._context
        plant.SetPositions(context, q)
        plant.SetVelocities(context, v)
        plant.CalcForceElementsContribution(context, self._forces)
        modelled = plant.CalcInverseDynamics(context, a, self._forces)
        return self._wrench(modelled - torque)

    def external(self, q: np.ndarray, torque: np.ndarray) -> np.ndarray:
        """Returns the wrench on the flange (6,) of external torques.

        Args:
            q: (n,) of the joints [rad].
            torque: (n,) that pushes on the arm, by its own estimate [N m].
        """
        self._plant.SetPositions(self._context, q)
        return self._wrench(torque)

    def torque(self, q: np.ndarray, wrench: np.ndarray) -> np.ndarray:
        """Returns the torques (n,) in the joints of a wrench on the flange (6,)."""
        self._plant.SetPositions(self._context, q)
        return np.asarray(self._jacobian().T @ np.roll(wrench, 3))

    def R_WF(self, q: np.ndarray) -> np.ndarray:
        """Returns the flange's orientation in the world (3, 3)."""
        self._plant.SetPositions(self._context, q)
        pose = self._frame_F.CalcPoseInWorld(self._context)
        return np.asarray(pose.rotation().matrix())

    def _wrench(self, torque: np.ndarray) -> np.ndarray:
        """Returns pinv(J^T) torque: what comes nearest to the torques (n,)."""
        F = np.linalg.lstsq(self._jacobian().T, torque, rcond=None)[0]
        return np.roll(F, 3)

    def _jacobian(self) -> np.ndarray:
        """Returns the Jacobian (6, n) at Fo in F, [rotation; translation]."""
        J = self._plant.CalcJacobianSpatialVelocity(
            self._context,
            JacobianWrtVariable.kV,
            self._frame_F,
            np.zeros(3),
            self._plant.world_frame(),
            self._frame_F,
        )
        return np.asarray(J)
