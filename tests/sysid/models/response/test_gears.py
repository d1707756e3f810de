"""Arms behind gears that yield or have play, against equations of their own."""

import dataclasses

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from drake_disasm.effects import (
    JointBacklash,
    JointElasticity,
    JointViscousFriction,
    RotorInertia,
)
from sysid.models.response.drive import Drive, Inputs
from sysid.models.response.gears import Gears
from sysid.models.response.near_motion import Bodies
from sysid.models.response.rigid_bodies import RigidBodies
from sysid.models.response.segments import Segment
from sysid.models.response.simulation import Arm, ParameterSet, simulate
from tests.sysid.models.arm import JOINTS, write_two_link_arm

K, D, B = np.array([60.0, 25.0]), np.array([4.0, 1.5]), np.array([0.3, 0.2])
EDGE = 0.4  # N m, that takes a link through half its play
INERTIA = np.array([0.4, 0.2])  # of the rotors
TIMES = np.linspace(0.0, 2.0, 401)


@pytest.fixture
def arm(tmp_path):
    urdf = write_two_link_arm(tmp_path / "two.urdf")
    return Arm(JOINTS, Bodies(RigidBodies(str(urdf), JOINTS), False))


def rest_at(arm, q_d):
    """Where a rigid arm is at rest that is told to be elsewhere."""
    q = q_d
    for _ in range(50):
        q = q_d - arm.bodies.arm.holding(q[None])[0] / K
    return q


def segment(arm, goal):
    """A segment that begins at rest, or nearly so."""
    one = np.ones((len(TIMES), 2))
    inputs = Inputs(goal, 0.0 * one, one, one, one)
    q = rest_at(arm, goal[0])
    return Segment(0.0, q, np.zeros(2), TIMES, inputs, np.zeros(2))


def swing(t):
    return np.stack([0.5 * np.sin(3.0 * t), 0.4 * np.cos(2.0 * t)], axis=-1)


def steady(q_d):
    return np.tile(q_d, (len(TIMES), 1))


def parameters(*effects):
    return ParameterSet(Drive(K, D, np.inf), 0.0, effects)


def motors(c=(0.0, 0.0), b=(0.0, 0.0), inertia=INERTIA):
    """Both joints' gears, rotors and friction, as effects."""
    return [
        *(JointElasticity(j, x) for j, x in zip(JOINTS, c, strict=True)),
        *(JointBacklash(j, x, EDGE) for j, x in zip(JOINTS, b, strict=True)),
        *(RotorInertia(j, x) for j, x in zip(JOINTS, inertia, strict=True)),
        *(JointViscousFriction(j, x) for j, x in zip(JOINTS, B, strict=True)),
    ]


def twist_of(torque, c, b):
    return c * torque + b / 2 * np.tanh(torque / EDGE)


def in_closed_form(arm, c, b):
    """Motors' positions by Spong's equations and an adaptive integrator."""
    torques = np.linspace(-100.0, 100.0, 20001)
    twists = np.ascontiguousarray(twist_of(torques[:, None], c, b).T)

    def slope(t, x):
        motor, link, motor_rate, link_rate = x.reshape(4, 2)
        terms = arm.bodies.terms(link[None], link_rate[None], ())
        torque = np.array(
            [np.interp(motor[i] - link[i], twists[i], torques) for i in (0, 1)]
        )
        goal = np.array([np.interp(t, TIMES, g) for g in swing(TIMES).T])
        drive = K * (goal - motor) - (D + B) * motor_rate
        link_vd = np.linalg.solve(terms.M[0], torque - terms.bias[0])
        return np.concatenate(
            [motor_rate, link_rate, (drive - torque) / INERTIA, link_vd]
        )

    q = rest_at(arm, swing(0.0))
    x = np.concatenate([q, q - twist_of(K * (swing(0.0) - q), c, b), np.zeros(4)])
    found = solve_ivp(slope, (0, 2), x, "Radau", TIMES[::4], rtol=1e-6, atol=1e-8)
    return found.y[:2].T


def errors_of(arm, c, b, h):
    """How far simulations in steps h, in halves, and without play are off at most."""
    reference = in_closed_form(arm, c, b)
    errors = []
    for step, play in ((h, b), (h / 2, b), (h, 0.0 * b))[: 2 + b.any()]:
        own, every = parameters(*motors(c, play)), round(0.02 / step)
        motion = simulate(arm, [own], [segment(arm, swing(TIMES))], 100 * every, step)
        errors.append(np.abs(motion.q[::every, 0, 0] - reference).max())
    return errors


def test_two_masses_on_a_spring_move_as_in_the_textbook(arm):
    coarse, fine = errors_of(arm, np.array([2e-3, 4e-3]), np.zeros(2), 0.005)
    assert coarse < 1e-3
    assert 3.0 < coarse / fine < 5.0


@pytest.mark.slow
def test_play_is_crossed_as_by_an_adaptive_integrator(arm):
    c, b = np.array([1e-3, 1e-3]), np.array([0.03, 0.0])
    coarse, fine, without = errors_of(arm, c, b, 0.001)
    assert without > 5e-3  # so much is seen of it
    assert coarse < 1e-3
    assert fine < 0.6 * coarse


def test_at_rest_a_motor_holds_what_hangs_on_the_yielding_link(arm):
    q_d, c, b = np.array([0.4, -0.2]), np.array([3e-3, 0.0]), np.array([0.02, 0.01])
    own = parameters(*motors(c, b, (0.0, 0.0)))
    motion = simulate(arm, [own], [segment(arm, steady(q_d))], 1000, 0.005)
    q = motion.q[-1, 0, 0]
    torque = K * (q_d - q)
    link = q - twist_of(torque, c, b)
    np.testing.assert_allclose(motion.v[-1], 0.0, atol=1e-9)
    np.testing.assert_allclose(torque, arm.bodies.arm.holding(link[None])[0], atol=1e-6)
    assert np.abs(torque - arm.bodies.arm.holding(q[None])[0]).max() > 0.02


def test_links_have_coordinates_only_where_some_lane_needs_them():
    sets = [(JointElasticity("b", 1e-3),), (JointBacklash("b", 0.01),), ()]
    gears = Gears.of(("a", "b", "c"), sets)
    assert gears.which.tolist() == [1]
    assert gears.compliance[:, 0].tolist() == [1e-3, 0.0, 0.0]
    assert gears.play[:, 0].tolist() == [0.0, 0.01, 0.0]
    x = np.array([1.0, 2.0, 3.0, 9.0])
    assert gears.links(x).tolist() == [1.0, 9.0, 3.0]
    assert gears.motors(x).tolist() == [1.0, 2.0, 3.0]
    assert not Gears.of(("a",), [()]).any


def test_a_segment_begins_with_the_link_where_its_load_has_it():
    gears = Gears.of(JOINTS, [(JointElasticity("elbow", 2e-3),)])
    q, v = np.array([[0.1, 0.2]]), np.array([[0.5, -0.2]])
    q, v = gears.start(q, v, np.array([[9.0, 5.0]]), np.array([[9.0, -7.0]]))
    np.testing.assert_allclose(q, [[0.1, 0.2, 0.2 - 2e-3 * 5.0]])
    np.testing.assert_allclose(v, [[0.5, -0.2, -0.2 + 2e-3 * 7.0]])


def test_a_segment_in_the_middle_of_a_motion_goes_on_with_it(arm):
    own = parameters(*motors((2e-3, 4e-3), inertia=(0.0, 0.0)))
    begin = segment(arm, swing(TIMES))
    whole = simulate(arm, [own], [begin], 2000, 0.001)
    q, v = (x[1000, 0, 0] for x in (whole.q, whole.v))
    vd = (whole.v[1001, 0, 0] - whole.v[999, 0, 0]) / 0.002
    later = dataclasses.replace(begin, start=1.0, q=q, v=v, vd=vd)
    rest = simulate(arm, [own], [later], 200, 0.005)
    off = np.abs(rest.q[:, 0, 0] - whole.q[1000::5, 0, 0]).max()
    assert off < 1e-3
    nowhere = dataclasses.replace(later, vd=vd + 3.0)  # rad/s^2: a noisy one
    noisy = simulate(arm, [own], [nowhere], 200, 0.005)
    assert np.abs(noisy.q[:, 0, 0] - whole.q[1000::5, 0, 0]).max() < 2e-3
