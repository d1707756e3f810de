"""One step of the twin with IMPACT: the equation it solves, and its derivative."""

import dataclasses

import numpy as np
import pytest
from pydrake.math import RollPitchYaw

from drake_disasm.impact import (
    ImpactConditions,
    ImpactLaw,
    ImpactStep,
    LockShape,
    Surroundings,
    turning,
)
from drake_disasm.scenario import LockConfig

M = np.diag([3.0, 3.0, 3.0, 0.02, 0.02, 0.02])
K, D = np.array([15e3] * 3 + [150.0] * 3), np.array([400.0] * 3 + [3.0] * 3)
TURNED = ImpactConditions(
    law=ImpactLaw(300.0, 1.4, 2.0, 0.1),
    shape=LockShape.of(LockConfig()),
    around=Surroundings(
        np.array([0.2]),
        RollPitchYaw(0.0, 0.03, 0.0).ToRotationMatrix().matrix()[None],
        np.array([[0.0, 0.0, 1e-4]]),
        np.zeros((1, 3)),
    ),
    M=M,
    K=K,
    D=D,
    p_BoTo_B=np.array([0.0, 0.015, 0.0]),
)
H = 0.0025
COUNT = 40


def states():
    """Returns q, v, qd, vd (n, 6) of a bolt pushed about in the groove."""
    random = np.random.default_rng(0)
    q = random.uniform(-1, 1, (COUNT, 6)) * [0, 2e-4, 4e-4, 0.01, 0.02, 0.01]
    q[:, 0] = random.uniform(0.0, 0.06, COUNT)
    v = random.uniform(-1, 1, (COUNT, 6)) * 0.01
    away = random.uniform(-1, 1, (COUNT, 6)) * [1e-3, 5e-4, 5e-4, 0.01, 0.01, 0.01]
    return q, v, q + away, np.zeros((COUNT, 6))


def test_springs_inertia_and_contact_balance_after_the_step():
    q, v, qd, vd = states()
    step = ImpactStep(TURNED, H, q, v, qd, vd)
    after, wrench = step.solve()
    E, R = turning(q[:, 3:])
    t_To = wrench[:, 3:] - np.cross(R @ TURNED.p_BoTo_B, wrench[:, :3])
    pushed = np.hstack([wrench[:, :3], np.einsum("nji,nj->ni", E, t_To)])
    rest = (after - v) @ M - H * (K * (qd - q - H * after) + D * (vd - after) + pushed)
    assert np.abs(pushed).max() > 1.0
    np.testing.assert_allclose(rest, 0.0, atol=5e-6)  # 1e-8 m/s, in a stiff wall


def test_without_contact_it_is_the_linear_step():
    free = dataclasses.replace(TURNED, law=ImpactLaw(0.0, 1.0, 0.0, 0.1))
    q, v, qd, vd = states()
    after, wrench = ImpactStep(free, H, q, v, qd, vd).solve()
    A = M + np.diag(H * D + H**2 * K)
    expected = np.linalg.solve(A, (v @ M + H * (K * (qd - q) + D * vd)).T).T
    np.testing.assert_allclose(after, expected, rtol=1e-9)
    assert not wrench.any()


def test_states_do_not_see_each_other():
    whole = ImpactStep(TURNED, H, *states()).solve()
    for i in (0, 7, COUNT - 1):
        alone = ImpactStep(TURNED, H, *(part[i : i + 1] for part in states())).solve()
        for one, all_of_them in zip(alone, whole, strict=True):
            assert one[0].tobytes() == all_of_them[i].tobytes()


def test_newtons_slope_is_the_derivative():
    step, v = ImpactStep(TURNED, H, *states()), states()[1]
    rows, d = np.arange(COUNT), 1e-8
    slope = step._balance(rows, v).slope
    for i, side in enumerate(d * np.eye(6)):
        change = step._balance(rows, v + side).r - step._balance(rows, v - side).r
        np.testing.assert_allclose(
            slope[:, :, i], change / (2 * d), rtol=1e-3, atol=1e-3
        )


def test_turning_maps_rates_of_angles_to_angular_velocity():
    angles, rates, d = np.array([[0.3, -0.2, 0.1]]), np.array([0.5, 0.7, -0.4]), 1e-7
    E, R = turning(angles)
    _, later = turning(angles + d * rates)
    W = (later - R)[0] / d @ R[0].T
    np.testing.assert_allclose(E[0] @ rates, [W[2, 1], W[0, 2], W[1, 0]], rtol=1e-5)


def test_what_no_force_balances_is_an_error(monkeypatch):
    monkeypatch.setattr("drake_disasm.impact.step._ITERATIONS", 1)
    with pytest.raises(RuntimeError, match="no force balances"):
        ImpactStep(TURNED, H, *states()).solve()
