"""Experiments in free space: from home and back, at rest there, within all limits."""

import numpy as np
import pytest

from drake_disasm.experiments import (
    JointExperiment,
    JointStrokes,
    PostureSteps,
    registered_joint_experiments,
)
from drake_disasm.free_motion.arm_limits import CollisionFreeSpace, JointLimits
from drake_disasm.free_motion.arm_space import ArmSpace
from drake_disasm.free_motion.rest_to_rest import PERIOD, straight
from drake_disasm.free_motion.table import MotionTable
from tests.refusals import refused

_IIWA = "package://disasm_models/iiwa14/iiwa14.urdf"
_JOINTS = tuple(f"iiwa_joint_{i}" for i in range(1, 8))


@pytest.fixture(scope="module")
def space() -> ArmSpace:
    limits = JointLimits.of_urdf(_IIWA, _JOINTS, 5.0, 0.1)
    collisions = CollisionFreeSpace(_IIWA, _JOINTS, limits, 0.02)
    return ArmSpace.of(limits, collisions, floor=0.15)


@pytest.mark.parametrize(
    "experiment",
    [each for kind in registered_joint_experiments() for each in kind.variants()],
    ids=lambda each: each.text,
)
def test_a_motion_is_within_limits(space: ArmSpace, experiment: JointExperiment):
    motion = experiment.plan(space).motion
    np.testing.assert_allclose(motion.q[[0, -1]], [space.home] * 2, atol=1e-9)
    v = np.gradient(motion.q, motion.time, axis=0)
    limits = space.limits
    assert (
        np.abs(v[[0, -1]]) <= 0.011 * limits.acceleration
    ).all()  # in a row of 10 ms
    assert (np.abs(v).max(axis=0) <= limits.velocity).all()
    vd = np.gradient(v, motion.time, axis=0)
    assert (np.abs(vd).max(axis=0) <= 1.01 * limits.acceleration).all()
    assert space.is_free(motion.q[::20])
    assert np.ptp(motion.q, axis=0).max() > 0.02


def test_strokes_are_as_fast_as_they_say(space: ArmSpace) -> None:
    motion = JointStrokes(speed=0.1, duration=10.0, times=2).motion(space)
    v = np.abs(np.gradient(motion.q, motion.time, axis=0))
    share = np.median(v, axis=0) / space.limits.velocity
    np.testing.assert_allclose(share, 0.1, rtol=1e-6)


def test_between_steps_the_arm_rests(space: ArmSpace) -> None:
    motion = PostureSteps(postures=3, rest=2.0).motion(space)
    still = (np.diff(motion.q, axis=0) == 0.0).all(axis=1)
    assert still.sum() * 0.01 == pytest.approx(4 * 2.0, abs=0.1)


def test_a_motion_that_hits_something_becomes_smaller(space: ArmSpace) -> None:
    limits = space.limits
    drawn = np.random.default_rng(1).uniform(limits.lower, limits.upper, (1000, 7))
    hit = next(q for q in drawn if not space.is_free(q[None]))
    ways = straight(limits, space.home, hit), straight(limits, hit, space.home)
    q = np.concatenate(ways)
    fitted = space.fitted(MotionTable(PERIOD * np.arange(len(q)), q))
    assert space.is_free(fitted.q[::5])
    share = np.ptp(fitted.q, axis=0) / np.ptp(q, axis=0)
    np.testing.assert_allclose(share, share[0])
    assert 0.1 < share[0] < 0.99


def test_a_parameter_out_of_bounds_is_refused(space: ArmSpace) -> None:
    with refused("JointStrokes.speed: 2 is not within 0.005 and 1"):
        JointStrokes(speed=2.0).plan(space)


def test_an_arm_without_free_space_is_refused() -> None:
    limits = JointLimits.of_urdf(_IIWA, _JOINTS, 5.0, 0.1)
    collisions = CollisionFreeSpace(_IIWA, _JOINTS, limits, 0.02)
    with refused("free space", "relax `clearance` or `floor`"):
        ArmSpace.of(limits, collisions, floor=3.0)
