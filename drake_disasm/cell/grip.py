"""How the bolt yields in the gripper: the fingers' springs, and the pads'.

Springs act in the middle of the pads, T, along and about the axes of the bolt as
gripped: x along the groove, y out of the plate, z across, along which the fingers
close.
"""

import dataclasses
from typing import Self

import numpy as np

from drake_disasm.cell.tool import Tool
from drake_disasm.common.arrays import Array, cross, namespace
from drake_disasm.common.spatial import velocity_shift
from drake_disasm.scenario import GripperConfig, Scenario

#: Joints along x, y, z, then about z, x, y, by number of axis. Springs stay independent
#: of each other, and an arm's along its own axes, however far a bolt turns about y.
AXIS_ORDER = (0, 1, 2, 5, 3, 4)
#: The place among those joints of each axis.
JOINT_OF_AXIS = tuple(np.argsort(AXIS_ORDER).tolist())

#: The simulated pads with rigid fingers behind them, as measured on the cell without
#: adaptive fingers; along z the finger drives are in series.
_PADS = np.array([270e3, 300e3, np.nan, 430.0, 300.0, 430.0])


@dataclasses.dataclass(frozen=True)
class Springs:
    """A spring and a damper for each of six axes.

    Attributes:
        stiffness: (6,) along and about x, y, z [N/m, N m/rad].
        damping: (6,) likewise [N s/m, N m s/rad].
    """

    stiffness: np.ndarray
    damping: np.ndarray

    @classmethod
    def damped(cls, stiffness: np.ndarray, ratio: float, inertia: np.ndarray) -> Self:
        """Returns springs with a damping ratio about what each axis moves.

        Args:
            stiffness: (6,) [N/m, N m/rad].
            ratio: 1 is critical.
            inertia: (6,) [kg, kg m^2].
        """
        return cls(stiffness, 2.0 * ratio * np.sqrt(stiffness * inertia))


def in_joint_order(springs: Springs) -> tuple[Array, Array]:
    """Returns stiffness and damping (..., 6) in the order of the twin's joints."""
    order = list(AXIS_ORDER)
    return springs.stiffness[..., order], springs.damping[..., order]


def deflection(
    grip: Springs, p_BoTo_B: Array, weight_Gn: Array, wrench: Array
) -> Array:
    """Returns by how much the grip gives (..., 6), in joint order, under wrenches.

    At rest, bolt against arm; no encoder sees it.

    Args:
        grip: the springs.
        p_BoTo_B: (..., 3) their middle [m].
        weight_Gn: (..., 3) of what the sensor carries [N].
        wrench: (..., 6) on the bolt at Bo in Gn, [f; tau], processed as the task's.
    """
    f, k = wrench[..., :3], grip.stiffness
    moved = f / k[..., :3]
    # About the pads where they are now; the sensor's place does not move along.
    t_To = wrench[..., 3:] - cross(p_BoTo_B, f) - cross(moved, f + weight_Gn)
    given = namespace(wrench).concat([moved, t_To / k[..., 3:]], axis=-1)
    return given[..., list(AXIS_ORDER)]


def gripped_inertia(tool: Tool) -> np.ndarray:
    """Returns mass and inertia about T (6,) of fingers and bolt [kg, kg m^2]."""
    M_T = tool.M_gripped_B.Shift(tool.p_BoTo_B)
    moments = M_T.CalcRotationalInertia().get_moments()
    return np.concatenate([np.full(3, M_T.get_mass()), moments])


def finger_springs(gripper: GripperConfig, tool: Tool) -> Springs:
    """Returns the springs of adaptive fingers, or of a tool without fingers."""
    inertia = gripped_inertia(tool)
    return Springs.damped(np.array(gripper.stiffness), gripper.damping_ratio, inertia)


def grip_springs(gripper: GripperConfig, tool: Tool) -> Springs:
    """Returns the springs between palm and bolt: fingers and pads in series.

    Without fingers they are the tool's own.
    """
    if not gripper.fingers:
        return finger_springs(gripper, tool)
    inertia = gripped_inertia(tool)
    pads = _PADS.copy()
    pads[2] = 2.0 * gripper.finger_stiffness
    behind_pads = Springs.damped(pads, 1.0, inertia)
    if gripper.compliance == "rigid":
        return behind_pads
    fingers = finger_springs(gripper, tool)
    stiffness = 1.0 / (1.0 / fingers.stiffness + 1.0 / pads)
    share = stiffness / fingers.stiffness  # of the motion that is the fingers'
    return Springs(stiffness, fingers.damping * share**2)


def bolt_compliance(scenario: Scenario) -> np.ndarray:
    """Returns how the bolt yields in the gripper under a wrench on it, (6, 6).

    Displacement of Bo and rotation, against where the flange would have the bolt, by
    the wrench [f; tau] on the bolt at Bo; all in Gn [m/N, m/(N m); rad/N, rad/(N m)].
    """
    tool = Tool.from_models(scenario)
    S = velocity_shift(tool.p_BoTo_B)
    return S @ np.diag(1.0 / grip_springs(scenario.gripper, tool).stiffness) @ S.T
