"""The twin's numbers, as they follow from arm, posture, control and gripper."""

import dataclasses
import functools
from typing import Self

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.tree import SpatialInertia

from drake_disasm.cell.arm_control import cartesian_gains, joint_gains
from drake_disasm.cell.arm_dynamics import ArmDynamics
from drake_disasm.cell.coordinates import ArmCoordinates
from drake_disasm.cell.grip import Springs, grip_springs
from drake_disasm.cell.placement import nominal_groove_pose
from drake_disasm.cell.tool import Tool
from drake_disasm.common.spatial import velocity_shift
from drake_disasm.scenario import Scenario


@dataclasses.dataclass(frozen=True)
class ControlledArm:
    """The arm under its controller, linear about a posture.

    M a + B v + D (v - v_d) + K (x - x_d) = f: x is the displacement of a point that is
    fixed to the flange and the rotation about it, both in Gn; x_d is the commanded one.

    Attributes:
        M, D, K: (6, 6) inertia, damping and stiffness [kg, N s/m, N/m; rad, N m].
        B: (6, 6) the joints' own damping, which does not know the command.
    """

    M: np.ndarray
    D: np.ndarray
    K: np.ndarray
    B: np.ndarray

    def at(self, p: np.ndarray) -> Self:
        """Returns the same for another point, at p (3,) from this one in Gn."""
        S = velocity_shift(p)
        matrices = (self.M, self.D, self.K, self.B)
        return type(self)(*(S.T @ matrix @ S for matrix in matrices))


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
        S = velocity_shift(self.p_BoTo_B)
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
        _arm_at(scenario, tool, X_GB or RigidTransform()).at(tool.p_BoTo_B),
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
    """What the controlled arm depends on; equal if its text is.

    Attributes:
        text: of the rest.
        scenario: its sections arm and placement, and the period of its task.
        tool: on the flange.
        X_GB: where along the way.
    """

    text: str
    scenario: Scenario = dataclasses.field(compare=False)
    tool: Tool = dataclasses.field(compare=False)
    X_GB: RigidTransform = dataclasses.field(compare=False)


def _arm_at(scenario: Scenario, tool: Tool, X_GB: RigidTransform) -> ControlledArm:
    """Returns the arm at Bo; from memory while nothing that it depends on changes.

    Identification asks for hundreds of parameter sets in which the arm is the same.
    """
    matrices = (
        tool.X_FB.GetAsMatrix34(),
        tool.M_F.CopyToFullMatrix6(),
        tool.M_palm_F.CopyToFullMatrix6(),
        X_GB.GetAsMatrix34(),
    )
    parts = (scenario.arm, scenario.placement, scenario.task.period)
    text = repr((*parts, *(matrix.tolist() for matrix in matrices)))
    return _controlled_arm(_Case(text, scenario, tool, X_GB))


@functools.lru_cache(maxsize=64)
def _controlled_arm(case: _Case) -> ControlledArm:
    scenario, tool, arm = case.scenario, case.tool, case.scenario.arm
    X_WG = nominal_groove_pose(scenario.placement)
    coordinates = ArmCoordinates(arm, X_WG, tool.X_FB, scenario.task.period)
    # The controller knows all of the tool; what is gripped moves behind the springs.
    known = ArmDynamics(arm, tool, X_WG)
    known.set_positions(coordinates.start(RigidTransform()))
    moving = ArmDynamics(arm, tool, X_WG, tool.M_palm_F)
    moving.set_positions(coordinates.start(case.X_GB))
    if arm.control == "cartesian_impedance":
        K, D = cartesian_gains(arm, known.bolt_inertia())
        inertia = moving.bolt_inertia()
        # Joint rates by that of the bolt where nothing holds the null space.
        T = np.linalg.solve(moving.mass_matrix(), moving.jacobian().T) @ inertia
        return ControlledArm(inertia, D, K, (T.T * known.joint_damping()) @ T)
    k, d = joint_gains(arm, np.diag(known.mass_matrix()))
    own = known.joint_damping()
    return _condensed(moving.jacobian(), moving.mass_matrix(), k, d, own)


def _condensed(
    J: np.ndarray, M: np.ndarray, k: np.ndarray, d: np.ndarray, own: np.ndarray
) -> ControlledArm:
    """Returns joints with springs as seen from a point, by static condensation.

    Joints take the places that cost their springs least, q = T x with
    T = k^-1 J^T (J k^-1 J^T)^-1 (Guyan, "Reduction of stiffness and mass matrices",
    AIAA Journal 3, 1965); so stiffness is exact, inertia and damping are for motion
    that is slow against the null space.

    Args:
        J: (6, n) Jacobian of the point.
        M: (n, n) mass matrix.
        k, d: (n,) stiffness and damping of the joints' control.
        own: (n,) damping of the joints themselves.
    """
    K = np.linalg.inv((J / k) @ J.T)
    T = (J / k).T @ K
    return ControlledArm(T.T @ M @ T, (T.T * d) @ T, K, (T.T * own) @ T)
