"""One step of the twin with IMPACT: the equation it solves, and its derivative."""

import dataclasses

import numpy as np
import pytest
from pydrake.math import RollPitchYaw

from drake_disasm.parts import DoorChain
from drake_disasm.twin import equations
from drake_disasm.twin.conditions import ImpactConditions, Surroundings
from drake_disasm.twin.contact_step import ImpactStep
from drake_disasm.twin.law import ImpactLaw
from drake_disasm.twin.plant import turning

M = np.diag([3.0, 3.0, 3.0, 0.02, 0.02, 0.02])
K, D = np.array([15e3] * 3 + [150.0] * 3), np.array([400.0] * 3 + [3.0] * 3)
TURNED = ImpactConditions(
    law=ImpactLaw(300.0, 1.4, 2.0, 0.1),
    gaps=DoorChain().gaps,
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


def unbalanced(conditions, h, step, q, v, qd, vd):
    """Returns contact's forces on the joints (n, 6), and the impulses left over."""
    after, wrench = step.v, step.wrench
    E, R = turning(q[:, 3:])
    t_To = wrench[:, 3:] - np.cross(R @ conditions.p_BoTo_B, wrench[:, :3])
    pushed = np.hstack([wrench[:, :3], np.einsum("nji,nj->ni", E, t_To)])
    moved = K * (qd - q - h * after) + D * (vd - after) + pushed
    return pushed, (after - v) @ M - h * moved


def test_springs_inertia_and_contact_balance_after_the_step():
    step = ImpactStep.of(TURNED, H, *states())
    assert step.is_solved.all()
    pushed, rest = unbalanced(TURNED, H, step, *states())
    assert np.abs(pushed).max() > 1.0
    np.testing.assert_allclose(rest, 0.0, atol=5e-6)  # 1e-8 m/s, in a stiff wall


@pytest.mark.parametrize("friction", [1.2, 2.2])
@pytest.mark.parametrize("h", [0.005, 0.01])
def test_they_balance_under_friction_on_which_newtons_method_alone_stops_short(
    friction, h
):
    around = dataclasses.replace(TURNED.around, friction=np.array([friction]))
    law = ImpactLaw(1000.0, 1.0, 1.0, 0.1)
    rough = dataclasses.replace(TURNED, law=law, around=around)
    random = np.random.default_rng(0)
    q = random.uniform(-1, 1, (200, 6)) * [0, 2e-4, 4e-4, 0.01, 0.02, 0.01]
    q[:, 0] = random.uniform(0.0, 0.06, len(q))
    away = random.uniform(-1, 1, q.shape) * [1e-3, 5e-4, 5e-4, 0.01, 0.01, 0.01]
    state = (q, random.uniform(-1, 1, q.shape) * 0.01, q + away, np.zeros(q.shape))
    step = ImpactStep.of(rough, h, *state)
    assert step.is_solved.all()
    _, rest = unbalanced(rough, h, step, *state)
    np.testing.assert_allclose(rest, 0.0, atol=2e-4)  # 1e-8 m/s of bolts that stick
    # Contact takes energy from a bolt or gives back what its springs had: it never
    # throws it.
    assert np.abs(step.v[:, :3]).max() < 0.5


def test_friction_of_given_normal_forces_only_brakes():
    random = np.random.default_rng(3)
    w = touching(random)
    w[equations.FRICTION] = 5.0
    part(w, equations.PRESSED, equations.PLACES)[:] = random.uniform(
        0.0, 100.0, equations.PLACES
    )
    part(w, equations.DEPTH, equations.PLACES)[:] = -1.0  # nothing touches
    for twist in random.uniform(-1, 1, (20, 6)) * 0.01:
        wrench, _, _ = balanced(w, twist, is_lagged=True)
        assert wrench @ twist < 0.0


def test_without_contact_it_is_the_linear_step():
    free = dataclasses.replace(TURNED, law=ImpactLaw(0.0, 1.0, 0.0, 0.1))
    q, v, qd, vd = states()
    step = ImpactStep.of(free, H, q, v, qd, vd)
    A = M + np.diag(H * D + H**2 * K)
    expected = np.linalg.solve(A, (v @ M + H * (K * (qd - q) + D * vd)).T).T
    np.testing.assert_allclose(step.v, expected, rtol=1e-9)
    assert not step.wrench.any()


def part(w, place, size):
    """Returns a view of what begins at a place of a workspace."""
    return w[place : place + size]


def touching(random):
    """Returns the workspace of a bolt that touches a few places."""
    w, count = np.full(equations.SIZE, np.nan), equations.PLACES
    depth = np.where(random.uniform(size=count) < 0.2, 2e-5, -1.0)
    part(w, equations.DEPTH, count)[:] = depth
    part(w, equations.ARM, 3 * count)[:] = random.uniform(-0.01, 0.01, 3 * count)
    normals = random.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    part(w, equations.NORMAL, 3 * count)[:] = np.ravel(normals)
    equations.set_moments(w)
    part(w, equations.LAW, 4)[:] = TURNED.law.row
    part(w, equations.STIFFNESS, count)[:] = TURNED.law.stiffness
    part(w, equations.EXPONENT, count)[:] = TURNED.law.exponent
    part(w, equations.A, 36)[:] = np.ravel(M + H * np.diag(D))
    part(w, equations.B, 6)[:], w[equations.FRICTION] = 0.0, 0.2
    return w


def balanced(w, twist, is_lagged=False):
    """Returns wrench, what is out of balance, and its slope at a twist."""
    places = (equations.TWIST, equations.W, equations.REST, equations.SLOPE)
    part(w, places[0], 6)[:] = twist
    equations.balance(H, is_lagged, *places, w)
    wrench, rest = (part(w, place, 6).copy() for place in places[1:3])
    return wrench, rest, part(w, places[3], 36).reshape(6, 6).copy()


@pytest.mark.parametrize("seed", range(2))
def test_newtons_slope_is_the_derivative(seed):
    random, d = np.random.default_rng(seed), 1e-8
    w, twist = touching(random), random.uniform(-1, 1, 6) * 0.01
    wrench, _, slope = balanced(w, twist)
    assert wrench.any()
    for i, side in enumerate(d * np.eye(6)):
        change = balanced(w, twist + side)[1] - balanced(w, twist - side)[1]
        np.testing.assert_allclose(slope[:, i], change / (2 * d), rtol=1e-3, atol=1e-3)


def test_the_elimination_solves_what_lapack_does():
    random = np.random.default_rng(1)
    A, b = random.normal(size=(6, 6)), random.normal(size=6)
    A[0, 0] = 0.0  # wants a pivot

    def solved(A):
        w = np.concatenate([np.ravel(A), b])
        equations.solve_in_place(0, 36, w)
        return w[36:]

    np.testing.assert_allclose(solved(A), np.linalg.solve(A, b), rtol=1e-10)
    assert not np.isfinite(solved(np.ones((6, 6)))).all()


def test_turning_maps_rates_of_angles_to_angular_velocity():
    angles, rates, d = np.array([[0.3, -0.2, 0.1]]), np.array([0.5, 0.7, -0.4]), 1e-7
    E, R = turning(angles)
    _, later = turning(angles + d * rates)
    W = (later - R)[0] / d @ R[0].T
    np.testing.assert_allclose(E[0] @ rates, [W[2, 1], W[0, 2], W[1, 0]], rtol=1e-5)


def test_what_no_force_balances_is_said_of_its_state_alone():
    q, v, qd, vd = states()
    vd[3] = np.nan
    is_solved = ImpactStep.of(TURNED, H, q, v, qd, vd).is_solved
    assert not is_solved[3] and is_solved.sum() == COUNT - 1
