"""Friction that builds up over a displacement, in arms behind their drives."""

import dataclasses

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from drake_disasm.effects import JointDahlFriction, JointSpring, JointViscousFriction
from sysid.models.response.drive import Drive, Inputs
from sysid.models.response.near_motion import Bodies
from sysid.models.response.rigid_bodies import RigidBodies
from sysid.models.response.segments import Segment
from sysid.models.response.simulation import Arm, ParameterSet, simulate
from tests.sysid.models.arm import JOINTS, write_two_link_arm

K, D = np.array([60.0, 25.0]), np.array([4.0, 1.5])
SIZE, SLIP, STIFFNESS = np.array([3.0, 1.0]), 0.05, 8.0
TIMES = np.linspace(0.0, 1.0, 201)
FRICTION = [
    JointDahlFriction(joint, size, SLIP)
    for joint, size in zip(JOINTS, SIZE, strict=True)
]


@pytest.fixture
def arm(tmp_path):
    urdf = write_two_link_arm(tmp_path / "two.urdf")
    return Arm(JOINTS, Bodies(RigidBodies(str(urdf), JOINTS), False))


def goal(t):
    return np.stack([0.5 * np.sin(3.0 * t), 0.4 * np.cos(2.0 * t)], axis=-1)


def segment():
    one = np.ones((len(TIMES), 2))
    inputs = Inputs(goal(TIMES), 0.0 * one, one, one, one)
    return Segment(0.0, np.array([0.1, 0.3]), np.zeros(2), TIMES, inputs, np.zeros(2))


def run(arm, *sets, segments=None, steps=200, h=0.005):
    sets = [ParameterSet(Drive(K, D, np.inf), 0.0, tuple(s)) for s in sets]
    return simulate(arm, sets, segments or [segment()], steps, h)


def exact(arm):
    """Rigid bodies by Drake, and Dahl's equation in time, by an adaptive integrator."""

    def slope(t, x):
        q, v, F = x[:2], x[2:4], x[4:]
        torque = K * (goal(t) - q) - D * v - F - [0.0, STIFFNESS * q[1]]
        terms = arm.bodies.terms(q[None], v[None], ())
        vd = np.linalg.solve(terms.M[0], torque - terms.bias[0])
        return np.concatenate(
            [v, vd, (SIZE * np.abs(v) / SLIP) * (np.sign(v) - F / SIZE)]
        )

    x = [0.1, 0.3, 0.0, 0.0, 0.0, 0.0]
    return solve_ivp(slope, (0, 1), x, "LSODA", TIMES[::4], rtol=1e-6, atol=1e-8)


def test_arms_with_friction_and_a_spring_move_as_their_equations_say(arm):
    effects = [*FRICTION, JointSpring("elbow", STIFFNESS)]
    reference = exact(arm).y[:2].T
    motion = run(arm, effects)
    assert np.abs(run(arm, []).q[::4, 0, 0] - reference).max() > 0.02
    np.testing.assert_allclose(motion.q[::4, 0, 0], reference, atol=5e-4)


def test_a_segment_begins_with_what_its_path_has_left(arm):
    """The second half alone, after the path of the first, is as in the whole."""
    whole, half = run(arm, FRICTION), 120
    begin = dataclasses.replace(
        segment(),
        start=float(TIMES[half]),
        q=whole.q[half, 0, 0],
        v=whole.v[half, 0, 0],
        path=(TIMES, whole.q[:, 0, 0]),
    )
    expected, blank = whole.q[half:, 0, 0], dataclasses.replace(begin, path=None)
    rest = run(arm, FRICTION, segments=[begin], steps=80).q[:, 0, 0]
    np.testing.assert_allclose(rest, expected, atol=2e-4)
    rest = run(arm, FRICTION, segments=[blank], steps=80).q[:, 0, 0]
    assert np.abs(rest - expected).max() > 2e-3


def test_sets_side_by_side_are_as_each_alone(arm):
    """Of other sizes and shapes, with none among them, and in two segments."""
    sets = [
        [JointViscousFriction("elbow", 0.1), JointDahlFriction("elbow", size, slip)]
        for size, slip in ((0.0, 0.01), (1.0, 0.01), (1.0, 0.04), (2.0, 0.04))
    ]
    segments = [segment(), dataclasses.replace(segment(), q=np.array([-0.2, 0.1]))]
    together = run(arm, *sets, segments=segments, steps=60)
    for i, effects in enumerate(sets):
        alone = run(arm, effects, segments=segments, steps=60)
        np.testing.assert_allclose(together.q[:, i], alone.q[:, 0], atol=1e-8)
