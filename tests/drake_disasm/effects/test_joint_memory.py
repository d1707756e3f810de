"""Friction that depends on the path, against Dahl's equation."""

import numpy as np
from scipy.integrate import solve_ivp

from drake_disasm.effects import JointDahlFriction

SIZE, SLIP = 3.0, 0.002  # N m, rad
EFFECT = JointDahlFriction("a", SIZE, SLIP)


def test_it_follows_dahls_equation_in_time() -> None:
    """dF/dt = sigma (1 - F sgn(v) / F_c) v by an integrator, through many reversals."""
    t, sigma = np.linspace(0.0, 2.0, 2001), SIZE / SLIP

    def v(t):
        return 0.01 * np.exp(-t) * (9.0 * np.cos(9.0 * t) - np.sin(9.0 * t))

    def rate(t, F):
        return sigma * (1.0 - F * np.sign(v(t)) / SIZE) * v(t)

    exact = solve_ivp(rate, (0.0, 2.0), [0.0], "LSODA", t, rtol=1e-8, atol=1e-9)
    found = EFFECT.torque(EFFECT.along(0.01 * np.exp(-t) * np.sin(9.0 * t)))
    np.testing.assert_allclose(found, exact.y[0], atol=2e-3 * SIZE)


def test_one_displacement_is_as_two_parts_of_it_and_as_many_at_once() -> None:
    memory, dq = np.array([-0.9, 0.0, 0.7]), np.array([0.003, -0.001, 0.0])
    at_once = EFFECT.remember(memory, dq)
    in_parts = EFFECT.remember(EFFECT.remember(memory, 0.3 * dq), 0.7 * dq)
    np.testing.assert_allclose(at_once, in_parts, rtol=1e-14)
    expected = np.sign(dq) + (memory - np.sign(dq)) * np.exp(-np.abs(dq) / SLIP)
    np.testing.assert_allclose(at_once, expected, atol=1e-15)
