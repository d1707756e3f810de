"""Fourier motions: rest at the ends, derivatives that belong together."""

import numpy as np
import pytest

from drake_disasm.free_motion.fourier import FourierMotion


@pytest.fixture
def motion() -> FourierMotion:
    random = np.random.default_rng(0)
    a, b = random.normal(size=(2, 3, 4))
    return FourierMotion(random.normal(size=3), a, b, 7.0)


def test_velocity_and_acceleration_are_the_derivatives(motion):
    time = np.linspace(0.0, 7.0, 200)
    step = 1e-5
    (before, v_before, _), (after, v_after, _) = (
        motion.states(time + d) for d in (-step, step)
    )
    _, v, vd = motion.states(time)
    assert (after - before) / (2.0 * step) == pytest.approx(v, abs=1e-6)
    assert (v_after - v_before) / (2.0 * step) == pytest.approx(vd, abs=1e-6)


def test_it_begins_and_ends_at_rest_in_the_same_posture(motion):
    q, v, vd = motion.at_rest().states(np.array([0.0, 7.0]))
    assert q[0] == pytest.approx(q[1])
    assert np.abs(v).max() < 1e-12 and np.abs(vd).max() < 1e-12
    assert np.ptp(motion.at_rest().states(np.linspace(0.0, 7.0, 50))[0]) > 0.1
    once = motion.at_rest()
    assert once.at_rest().a == pytest.approx(once.a)
    assert once.at_rest().b == pytest.approx(once.b)


def test_scaling_is_about_the_centre_and_by_joint(motion):
    time = np.linspace(0.0, 7.0, 9)
    q, v, _ = motion.states(time)
    q_scaled, v_scaled, _ = motion.scaled(np.array([0.0, 1.0, 2.0])).states(time)
    assert q_scaled - motion.centre == pytest.approx((q - motion.centre) * [0, 1, 2])
    assert v_scaled == pytest.approx(v * [0.0, 1.0, 2.0])
