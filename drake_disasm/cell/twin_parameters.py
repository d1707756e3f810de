"""The twin's numbers, as they follow from arm, posture, control and gripper."""

import dataclasses
import functools
from typing import Self

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import JacobianWrtVariable, SpatialInertia

from drake_disasm.cell.arm_control import cartesian_gains, joint_gains
from drake_disasm.cell.coordinates import ArmCoordinates
from drake_disasm.cell.grip import Springs, grip_springs
from drake_disasm.cell.parsing import add_arm
from drake_disasm.cell.placement import nominal_groove_pose
from drake_disasm.cell.tool import Tool
from drake_disasm.common.spatial import skew
from drake_disasm.scenario import Scenario

#: Of the joints themselves in the model file [N m s/rad].
_JOINT_DAMPING = 0.5


@dataclasses.dataclass(frozen=True)
class ControlledArm:
    """The arm under its controller, linear about a posture: M a + D v + K x = f.

    x is the displacement of a point that is fixed to the flange and the rotation about
    it, both in Gn, from where the controller is commanded to be.

    Attributes:
        M, D, K: (6, 6) inertia, damping and stiffness [kg, N s/m, N/m; rad, N m].
    """

    M: np.ndarray
    D: np.ndarray
    K: np.ndarray

    def at(self, p: np.ndarray) -> Self:
        """Returns the same for another point, at p (3,) from this one in Gn."""
        S = np.eye(6)  # velocity of this point by that of the other
        S[:3, 3:] = skew(p)
        return type(self)(*(S.T @ matrix @ S for matrix in (self.M, self.D, self.K)))


@dataclasses.dataclass(frozen=True)
class TwinParameters:
    """What the twin is made of, besides contact.

    Attributes:
        arm: at the middle of the pads, To, in Gn.
        grip: springs between arm and bolt there, along and about the axes of Gn.
        M_fingers_B: inertia of the fingers, which move with the bolt, about Bo in B.
        p_BoTo_B: (3,) of To in B [m].
        X_SB: the bolt in the sensor's frame.
    """

    arm: ControlledArm
    grip: Springs
    M_fingers_B: SpatialInertia
    p_BoTo_B: np.ndarray
    X_SB: RigidTransform

    def bolt_stiffness(self) -> np.ndarray:
        """Returns force over displacement (6,) at Bo along and about the axes of Gn.

        Of each axis by itself, arm and grip in series [N/m, N m/rad].
        """
        compliance = np.linalg.inv(self.arm.K) + np.diag(1.0 / self.grip.stiffness)
        S = np.eye(6)  # displacement of Bo by that of To
        S[:3, 3:] = skew(self.p_BoTo_B)
        return 1.0 / np.diag(S @ compliance @ S.T)


def twin_of(scenario: Scenario, X_GB: RigidTransform | None = None) -> TwinParameters:
    """Returns the twin's parameters for a scenario's arm, control and gripper.

    Args:
        scenario: of the cell.
        X_GB: where along the way; None is A.

    Raises:
        DisasmError: the arm can't reach the lock.
    """
    tool = Tool.from_models(scenario)
    return TwinParameters(
        _arm_at(scenario, X_GB).at(tool.p_BoTo_B),
        grip_springs(scenario.gripper, tool),
        tool.M_fingers_B,
        tool.p_BoTo_B,
        tool.X_SB,
    )


def bolt_stiffness(scenario: Scenario) -> np.ndarray:
    """Returns force over displacement (6,) at the bolt, along and about Gn's axes.

    Of arm and grip together, each axis by itself, at A [N/m, N m/rad].

    Raises:
        DisasmError: the arm can't reach the lock.
    """
    return twin_of(scenario).bolt_stiffness()


@dataclasses.dataclass(frozen=True)
class _Case:
    """What the controlled arm depends on; equal if that is.

    Attributes:
        text: of the scenario's sections, and where along the way.
        scenario, X_GB: the same.
    """

    text: str
    scenario: Scenario = dataclasses.field(compare=False)
    X_GB: RigidTransform = dataclasses.field(compare=False)


def _arm_at(scenario: Scenario, X_GB: RigidTransform | None) -> ControlledArm:
    """Returns the arm at Bo; from memory while nothing that it depends on changes.

    Identification asks for hundreds of parameter sets in which the arm is the same.
    """
    X_GB = X_GB or RigidTransform()
    sections = [
        repr(getattr(scenario, name))
        for name in ("arm", "placement", "lock", "gripper", "ft_sensor")
    ]
    place = repr(X_GB.GetAsMatrix34().tolist())
    return _controlled_arm(_Case("\n".join([*sections, place]), scenario, X_GB))


@functools.lru_cache(maxsize=64)
def _controlled_arm(case: _Case) -> ControlledArm:
    scenario, tool = case.scenario, Tool.from_models(case.scenario)
    X_WG = nominal_groove_pose(scenario.placement)
    period = scenario.task.period
    coordinates = ArmCoordinates(scenario.arm, X_WG, tool.X_FB, period)
    start = coordinates.start(RigidTransform())
    J_start, inertia_start, _ = _mechanics(scenario, tool, start)
    q = coordinates.start(case.X_GB)
    J, _, without_bolt = _mechanics(scenario, tool, q)
    if scenario.arm.control == "cartesian_impedance":
        K, D = cartesian_gains(scenario.arm, _operational(J_start, inertia_start))
        return ControlledArm(_operational(J, without_bolt), D, K)
    k, d = joint_gains(scenario.arm, np.diag(inertia_start))
    return _condensed(J, without_bolt, k, d + _JOINT_DAMPING)


def _condensed(
    J: np.ndarray, M: np.ndarray, k: np.ndarray, d: np.ndarray
) -> ControlledArm:
    """Returns joints with springs as seen from a point, by static condensation.

    Joints take the places that cost their springs least, q = T x with
    T = k^-1 J^T (J k^-1 J^T)^-1 (Guyan, "Reduction of stiffness and mass matrices",
    AIAA Journal 3, 1965); so stiffness is exact, inertia and damping are for motion
    that is slow against the null space.

    Args:
        J: (6, 7) Jacobian of the point.
        M: (7, 7) mass matrix.
        k, d: (7,) stiffness and damping of the joints.
    """
    K = np.linalg.inv((J / k) @ J.T)
    T = (J / k).T @ K
    return ControlledArm(T.T @ M @ T, (T.T * d) @ T, K)


def _operational(J: np.ndarray, M: np.ndarray) -> np.ndarray:
    """Returns the inertia (6, 6) that a force at a point meets, (J M^-1 J^T)^-1."""
    return np.linalg.inv(J @ np.linalg.solve(M, J.T))


def _mechanics(
    scenario: Scenario, tool: Tool, q: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns Jacobian (6, 7) of Bo in Gn, and mass matrices (7, 7) of arm and tool.

    The first with all of the tool, as the controller knows it; the second without
    what is gripped by fingers that yield.
    """
    plant = MultibodyPlant(0.0)
    instance, frame_F = add_arm(plant, scenario.arm.model)
    load = plant.AddRigidBody("tool", instance, tool.M_F)
    plant.WeldFrames(frame_F, load.body_frame())
    plant.Finalize()
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, q)
    world = plant.world_frame()
    J_W = plant.CalcJacobianSpatialVelocity(
        context,
        JacobianWrtVariable.kV,
        frame_F,
        tool.X_FB.translation(),
        world,
        world,
    )
    R_GW = nominal_groove_pose(scenario.placement).rotation().matrix().T
    whole = plant.CalcMassMatrix(context)
    load.SetSpatialInertiaInBodyFrame(context, tool.M_palm_F)
    J = np.vstack([R_GW @ J_W[3:], R_GW @ J_W[:3]])
    return J, whole, plant.CalcMassMatrix(context)
