"""Stiffness and damping of the arm's controller, for each of its controls.

The one place of these gains: the cell is controlled with them, and the twin's springs
are made of them.
"""

import numpy as np
from scipy.linalg import eigh

from drake_disasm.cell.arm_description import per_joint
from drake_disasm.scenario import ArmConfig

_INERTIA = 4.0  # kg m^2, of a joint with its rotor, for position control's damping


def joint_gains(arm: ArmConfig, inertia: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Returns stiffness (n,) [N m/rad] and damping (n,) [N m s/rad] of the joints.

    d = 2 zeta sqrt(k m). Position control takes the same m for each joint, as drives
    are tuned once; joint impedance control takes that of the posture. With Cartesian
    impedance control there are no springs in the joints: both are zero.

    Args:
        arm: with its control.
        inertia: (n,) diagonal of the mass matrix, with the tool, at the start
            [kg m^2].
    """
    if arm.control == "cartesian_impedance":
        return np.zeros_like(inertia), np.zeros_like(inertia)
    if arm.control == "joint_impedance":
        config, key = arm.joint_impedance, "arm.joint_impedance.stiffness"
        k = per_joint(config.stiffness, len(inertia), key)
        return k, 2.0 * config.damping_ratio * np.sqrt(k * inertia)
    k = per_joint(arm.stiffness, len(inertia), "arm.stiffness")
    return k, 2.0 * arm.damping_ratio * np.sqrt(k * _INERTIA)


def cartesian_gains(
    arm: ArmConfig, Lambda: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Returns stiffness and damping (6, 6) of Cartesian impedance control.

    At Bo in Gn, [translation; rotation]. The damping is that of Albu-Schaeffer,
    Ott, Frese and Hirzinger, "Cartesian impedance control of redundant robots"
    (ICRA 2003), by double diagonalisation: with Lambda = Q Q^T and K = Q K0 Q^T
    (K0 diagonal), D = 2 zeta Q sqrt(K0) Q^T, so that each mode of Lambda and K has
    the damping ratio zeta.

    Args:
        arm: its `cartesian_impedance`, whatever its control.
        Lambda: (6, 6) inertia (J M^-1 J^T)^-1 at Bo in Gn, with the tool, at the
            start [kg, kg m, kg m^2].
    """
    config = arm.cartesian_impedance
    K = np.diag(config.stiffness)
    K0, V = eigh(K, Lambda)  # V^T Lambda V = 1, so Q = V^-T = Lambda V
    Q = Lambda @ V
    return K, 2.0 * config.damping_ratio * (Q * np.sqrt(K0)) @ Q.T


def yielding(arm: ArmConfig, J: np.ndarray) -> np.ndarray:
    """Returns how far a load on the bolt turns the joints (n, 6) [rad/N, rad/(N m)].

    dq = C w, for the wrench w = [f; tau] at Bo in Gn and the commanded joint angles.
    Springs in the joints: C = k^-1 J^T. Cartesian impedance control: C = J^+ K^-1;
    its null space's spring, the same in all joints, leaves the least joint motion.

    Args:
        arm: with its control.
        J: (6, n) Jacobian at Bo in Gn, [translation; rotation].
    """
    if arm.control == "cartesian_impedance":
        return np.asarray(np.linalg.pinv(J) / arm.cartesian_impedance.stiffness)
    k, _ = joint_gains(arm, np.ones(len(J.T)))
    return np.asarray(J.T / k[:, None])


def nullspace_gains(
    arm: ArmConfig, inertia: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Returns stiffness and damping (n,) of Cartesian impedance's null space.

    Args:
        arm: its `cartesian_impedance`, whatever its control.
        inertia: see `joint_gains`.
    """
    config = arm.cartesian_impedance
    k = np.full_like(inertia, config.nullspace_stiffness)
    return k, 2.0 * config.nullspace_damping_ratio * np.sqrt(k * inertia)
