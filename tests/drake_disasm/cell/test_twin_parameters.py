"""What the twin is made of, against closed forms."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from drake_disasm.cell.grip import Springs
from drake_disasm.cell.twin_parameters import ControlledArm, _condensed, twin_of
from drake_disasm.scenario import load_scenario
from drake_disasm.stations import TwinStation
from drake_disasm.twin.arm_step import ArmStep

_P = np.array([0.0, 0.02, 0.01])
_ORDER = [0, 1, 2, 5, 3, 4]  # along x, y, z, about z, x, y


def _positive(random: np.random.Generator, scale: np.ndarray) -> np.ndarray:
    """Returns a symmetric positive definite matrix with some scales."""
    A = random.uniform(-0.2, 0.2, (6, 6)) + np.eye(6)
    S = np.diag(np.sqrt(scale))
    return S @ (A @ A.T) @ S


def _arm(seed: int = 0) -> ControlledArm:
    random = np.random.default_rng(seed)
    M = _positive(random, np.array([4.0] * 3 + [0.05] * 3))
    K = _positive(random, np.array([16e3] * 3 + [400.0] * 3))
    return ControlledArm(M, 0.02 * K, K, 0.5 * M)


def test_another_point_has_the_same_energy() -> None:
    """Twist of one point by that of the other: v1 = v2 + w x (p1 - p2)."""
    arm, twist = _arm(), np.array([0.1, -0.2, 0.3, 1.0, 2.0, -1.5])
    moved, there = arm.at(_P), twist.copy()
    there[:3] += np.cross(twist[3:], _P)
    for name in "MDKB":
        here, other = getattr(arm, name), getattr(moved, name)
        assert there @ other @ there == pytest.approx(twist @ here @ twist)


def test_condensed_joints_give_way_as_springs_in_series() -> None:
    """A force f turns joints by k^-1 J^T f; 6 joints lose nothing to condensation."""
    random = np.random.default_rng(1)
    J, k = random.uniform(-1, 1, (6, 7)), random.uniform(5e3, 2e4, 7)
    M, f = np.diag(random.uniform(1, 2, 7)), random.uniform(-1, 1, 6)
    arm = _condensed(J, M, k, np.ones(7), np.zeros(7))
    np.testing.assert_allclose(np.linalg.solve(arm.K, f), J @ (J.T @ f / k))
    square = _condensed(J[:, :6], M[:6, :6], k[:6], np.ones(6), np.zeros(6))
    inverse = np.linalg.inv(J[:, :6])
    np.testing.assert_allclose(square.M, inverse.T @ M[:6, :6] @ inverse, rtol=1e-6)


def test_a_step_without_springs_is_the_exact_solution() -> None:
    """M a = K (x_d - x) + D (v_d - v) - B v, the command moving evenly."""
    arm, h, none = _arm(2), 0.005, np.zeros(6)
    step = ArmStep.of(arm, Springs(none, none), h)
    order = np.ix_(_ORDER, _ORDER)
    M, D, K, B = (m[order] for m in (arm.M, arm.D, arm.K, arm.B))
    random = np.random.default_rng(3)
    x, v, end, rate = random.uniform(-1, 1, (4, 6)) * 1e-3

    def motion(t: float, state: np.ndarray) -> np.ndarray:
        command = end + (t - h) * rate
        pull = K @ (command - state[:6]) + D @ (rate - state[6:]) - B @ state[6:]
        return np.concatenate([state[6:], np.linalg.solve(M, pull)])

    start = np.concatenate([x, v])
    exact = solve_ivp(motion, (0, h), start, rtol=1e-10, atol=1e-14).y[:, -1]
    found = step.ahead(start, np.concatenate([end, rate]))
    np.testing.assert_allclose(found, exact, rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize("compliance", ["adaptive", "rigid"])
def test_grip_and_arm_are_in_series(compliance: str) -> None:
    scenario = load_scenario("removal", [f"gripper.compliance={compliance}"])
    twin = twin_of(scenario)
    alone = 1.0 / np.diag(np.linalg.inv(twin.arm.K))
    assert np.all(twin.bolt_stiffness()[3:] < alone[3:])
    if compliance == "adaptive":
        shares = twin.grip.stiffness / scenario.gripper.stiffness
        assert np.all((shares > 0.95) & (shares < 1.0))
        assert np.all(twin.bolt_stiffness()[:3] < 600.0)
    else:
        assert np.all(twin.bolt_stiffness()[:3] > 1e4)


@pytest.mark.parametrize("compliance", ["adaptive", "rigid"])
def test_the_shipped_step_is_stable(compliance: str) -> None:
    scenario = load_scenario("removal", [f"gripper.compliance={compliance}"])
    twin, h = TwinStation(scenario).parameters, scenario.simulation.twin_time_step
    assert ArmStep.of(twin.arm, twin.grip, h).is_stable
