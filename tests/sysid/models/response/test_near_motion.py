"""Rigid bodies to first order about a motion, beside Drake's own."""

import numpy as np
import pytest

from sysid.models.response.near_motion import Bodies, Expansion
from sysid.models.response.rigid_bodies import RigidBodies
from tests.sysid.models.arm import JOINTS, write_two_link_arm

STEPS, SEGMENTS = 5, 3


@pytest.fixture
def bodies(tmp_path):
    urdf = write_two_link_arm(tmp_path / "two.urdf")
    return Bodies(RigidBodies(str(urdf), JOINTS), compensates=True)


@pytest.fixture
def motion():
    random = np.random.default_rng(0)
    return random.uniform(-1.5, 1.5, (2, STEPS, SEGMENTS, len(JOINTS)))


def states(motion, step, off):
    """Three sets of states (sets, segments, joints) so far from a motion's step."""
    random = np.random.default_rng(1)
    shape = (3, SEGMENTS, len(JOINTS))
    return [
        m[step] + s * random.uniform(-1, 1, shape)
        for m, s in zip(motion, off, strict=True)
    ]


def by_drake(bodies, q, v):
    found = bodies.terms(q.reshape(-1, 2), v.reshape(-1, 2), ())
    return [a.reshape(*q.shape, *a.shape[2:]) for a in (found.M, found.bias)]


@pytest.mark.parametrize(("off", "most"), [((1e-4, 1e-4), 1e-6), ((0.02, 0.1), 0.02)])
def test_close_to_the_motion_the_error_is_of_second_order(bodies, motion, off, most):
    expansion = Expansion.along(bodies, *motion)
    for step in range(STEPS):
        q, v = states(motion, step, off)
        found, far = expansion.at(step, q, v)
        assert not far.any()
        M, bias = by_drake(bodies, q, v)
        np.testing.assert_allclose(found.M, M, atol=most)
        np.testing.assert_allclose(found.bias, bias, atol=most)
        holding = bodies.arm.holding(q.reshape(-1, 2)).reshape(q.shape)
        np.testing.assert_allclose(found.added, holding, atol=most)


def test_states_that_are_far_or_no_numbers_are_named(bodies, motion):
    expansion = Expansion.along(bodies, *motion)
    q, v = states(motion, 2, (0.0, 0.0))
    q[0, 1, 0] += 0.03
    v[1, 2, 1] -= 0.2
    q[2, 0] = np.nan
    _, far = expansion.at(2, q, v)
    assert np.argwhere(far).tolist() == [[0, 1], [1, 2], [2, 0]]
