"""The controller's gains against closed forms."""

import numpy as np
import pytest
from scipy.linalg import eigvals

from drake_disasm.cell.arm_control import (
    cartesian_gains,
    joint_gains,
    nullspace_gains,
    yielding,
)
from drake_disasm.scenario import CONTROLS, ArmConfig

INERTIA = np.array([3.0, 4.0, 2.0, 3.0, 0.5, 1.2, 1.0])
K = [3000.0, 500.0, 100.0, 300.0, 20.0, 5.0]


def _coupled_inertia() -> np.ndarray:
    A = np.random.default_rng(1).normal(size=(6, 6))
    return np.asarray(A @ A.T + np.diag([5.0, 5.0, 5.0, 0.5, 0.5, 0.5]))


def test_joint_gains_of_position_and_cartesian_control() -> None:
    k, d = joint_gains(ArmConfig(stiffness=[8e3] * 7, damping_ratio=0.5), INERTIA)
    np.testing.assert_allclose(k, 8e3)
    np.testing.assert_allclose(d, np.sqrt(8e3 * 4.0))
    for gain in joint_gains(ArmConfig(control="cartesian_impedance"), INERTIA):
        np.testing.assert_array_equal(gain, np.zeros(7))


def test_springs_are_damped_about_each_joints_inertia() -> None:
    arm = ArmConfig(control="joint_impedance")
    arm.joint_impedance.stiffness = list(np.arange(1.0, 8.0) * 100.0)
    arm.joint_impedance.damping_ratio = 0.3
    k, d = joint_gains(arm, INERTIA)
    np.testing.assert_allclose(k, arm.joint_impedance.stiffness)
    poles = (-d + np.emath.sqrt(d**2 - 4.0 * INERTIA * k)) / (2.0 * INERTIA)
    np.testing.assert_allclose(-poles.real / np.abs(poles), 0.3)
    arm = ArmConfig()
    arm.cartesian_impedance.nullspace_stiffness = 50.0
    arm.cartesian_impedance.nullspace_damping_ratio = 0.5
    k, d = nullspace_gains(arm, INERTIA)
    np.testing.assert_allclose(k, 50.0)
    np.testing.assert_allclose(d, np.sqrt(50.0 * INERTIA))


def test_cartesian_damping_of_a_diagonal_inertia_is_that_of_each_axis() -> None:
    arm, inertia = ArmConfig(), np.array([5.0, 4.0, 3.0, 0.2, 0.3, 0.4])
    arm.cartesian_impedance.stiffness = K
    found_K, D = cartesian_gains(arm, np.diag(inertia))
    np.testing.assert_allclose(found_K, np.diag(K))
    expected = np.diag(2.0 * 0.7 * np.sqrt(K * inertia))
    np.testing.assert_allclose(D, expected, atol=1e-9)


def test_every_mode_of_a_coupled_inertia_has_the_damping_ratio() -> None:
    arm, Lambda, ratio = ArmConfig(), _coupled_inertia(), 0.1
    arm.cartesian_impedance.stiffness = K
    arm.cartesian_impedance.damping_ratio = ratio
    found_K, D = cartesian_gains(arm, Lambda)
    np.testing.assert_allclose(D, D.T)
    A = np.block([[np.zeros((6, 6)), np.eye(6)], [-found_K, -D]])
    poles = eigvals(A, np.block([[np.eye(6), np.zeros((6, 6))],
                                 [np.zeros((6, 6)), Lambda]]))  # fmt: skip
    np.testing.assert_allclose(-poles.real / np.abs(poles), ratio, rtol=1e-6)


def _joint_angles(arm: ArmConfig, J: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Returns where the joints rest under a load on the bolt: torques balance."""
    if arm.control != "cartesian_impedance":
        k, _ = joint_gains(arm, INERTIA)
        return np.asarray(J.T @ w / k)
    K, _ = cartesian_gains(arm, np.eye(6))
    null = np.linalg.svd(J)[2][-1:]  # along which the null space's spring has rest
    balance = np.vstack([K @ J, null])
    return np.asarray(np.linalg.solve(balance, np.append(w, 0.0)))


@pytest.mark.parametrize("control", CONTROLS)
def test_joints_yield_to_a_load_as_their_springs_do(control: str) -> None:
    arm, generator = ArmConfig(control=control), np.random.default_rng(2)
    arm.cartesian_impedance.stiffness = K
    J, w = generator.normal(size=(6, 7)), generator.normal(size=6)
    np.testing.assert_allclose(yielding(arm, J) @ w, _joint_angles(arm, J, w))
