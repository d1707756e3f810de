"""Physical bodies with given base parameters."""

import functools

import numpy as np
import pytest

from sysid.export.consistent_inertia import (
    ball,
    consistent_inertia,
    inertial_of,
    pseudo_inertia,
)
from sysid.models.regressor import ArmRegressor, base_set
from tests.refusals import refused
from tests.sysid.export.arms import IIWA, IIWA_JOINTS, changed


@functools.cache
def iiwa() -> tuple[ArmRegressor, np.ndarray]:
    arm = ArmRegressor(IIWA, IIWA_JOINTS)
    base = base_set(arm.random_regressor())
    return arm, base.matrix(len(arm.inertia))


def eigenvalues(pi: np.ndarray) -> np.ndarray:
    bodies = [each for each in pi.reshape(-1, 10) if each[0] > 0.0]
    return np.array([np.linalg.eigvalsh(pseudo_inertia(each)) for each in bodies])


def test_a_pseudo_inertia_has_all_of_a_body():
    body = ball(1.3, (0.1, -0.2, 0.3))
    np.testing.assert_allclose(inertial_of(pseudo_inertia(body)), body, atol=1e-15)


def test_the_nominal_arms_base_parameters_give_the_nominal_arm():
    arm, B = iiwa()
    beta = B @ arm.inertia
    found = consistent_inertia(B, arm.inertia, beta, np.eye(len(beta)))
    np.testing.assert_allclose(found.inertia, arm.inertia, atol=1e-9)
    assert found.changed == () and found.is_exact
    assert found.divergence == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_other_bodies_base_parameters_are_kept_by_bodies_closer_to_nominal(seed):
    arm, B = iiwa()
    pi = changed(arm.inertia, 0.3, seed)
    beta = B @ pi
    found = consistent_inertia(B, arm.inertia, beta, np.eye(len(beta)))
    np.testing.assert_allclose(found.beta, beta, rtol=1e-9, atol=1e-11)
    assert found.is_exact and (eigenvalues(found.inertia) > 0.0).all()
    assert found.divergence <= _divergence(arm.inertia, pi)


def _divergence(nominal: np.ndarray, pi: np.ndarray) -> float:
    total = 0.0
    pairs = zip(nominal.reshape(-1, 10), pi.reshape(-1, 10), strict=True)
    for own, other in list(pairs)[1:]:  # the base does not move
        if own[0] > 0.0:
            X = np.linalg.solve(pseudo_inertia(own), pseudo_inertia(other))
            total += np.trace(X) - np.linalg.slogdet(X)[1] - 4.0
    return total


def test_parameters_a_little_off_what_is_physical_give_the_closest():
    arm, B = iiwa()
    beta = B @ arm.inertia
    own = np.array([arm.names[i].rpartition(".")[2] for i in np.argmax(B == 1.0, 1)])
    is_inertia = np.char.startswith(own, "I")
    off = np.where(is_inertia, -2.0 * beta, beta)
    sigma = np.where(is_inertia, 2.0 * np.abs(off), 1e-2) + 1e-3
    found = consistent_inertia(B, arm.inertia, off, np.diag(sigma**2))
    assert 0.0 < found.distance <= found.limit and not found.is_exact
    assert (eigenvalues(found.inertia) > 0.0).all()


@pytest.mark.parametrize("factor, sigma", [(0.5, 0.1), (-1.0, 1e-3)])
def test_parameters_that_no_body_has_are_refused(factor, sigma):
    arm, B = iiwa()
    beta = B @ arm.inertia
    beta[np.argmax(np.abs(beta))] *= factor - 0.6
    with refused("no physical inertia", "motor constants"):
        consistent_inertia(B, arm.inertia, beta, sigma**2 * np.eye(len(beta)))


def test_thin_and_missing_nominal_bodies_are_no_obstacle():
    arm, B = iiwa()
    thin = arm.inertia.copy().reshape(-1, 10)
    thin[2, 4:] *= 1e-6  # a point of mass away from its own centre is no body
    pi = changed(arm.inertia, 0.1)
    found = consistent_inertia(B, thin.reshape(-1), B @ pi, np.eye(43))
    np.testing.assert_allclose(found.beta, B @ pi, rtol=1e-9, atol=1e-11)
    assert (eigenvalues(found.inertia)[1:] > 0.0).all()


def test_a_payloads_mass_and_moment_are_held():
    arm, B = iiwa()
    body = np.array([1.5, 0.0, 0.03, 0.1])
    last = arm.last_link
    nominal = np.concatenate([arm.inertia, ball(1.5, body[1:] / 1.5)])
    point = inertial_of(np.outer([*body[1:] / 1.5, 1.0], [*body[1:] / 1.5, 1.0]) * 1.5)
    total = arm.inertia.copy()
    total[last] += point
    beta, columns = B @ total, np.hstack([B, B[:, last]])
    held = {len(arm.inertia) + i: value for i, value in enumerate(body)}
    found = consistent_inertia(columns, nominal, beta, np.eye(len(beta)), held)
    np.testing.assert_allclose(found.inertia[-10:-6], body, atol=1e-9)
    np.testing.assert_allclose(found.beta, beta, rtol=1e-9, atol=1e-11)
    assert found.is_exact and (eigenvalues(found.inertia) > 0.0).all()
