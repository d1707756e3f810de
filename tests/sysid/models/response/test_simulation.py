import dataclasses

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from drake_disasm.effects import (
    ArmTilt,
    FlangePayload,
    JointCoulombFriction,
    JointLoadFriction,
    JointViscousFriction,
    RotorInertia,
)
from sysid.models.regressor import ArmRegressor
from sysid.models.response.drive import Drive, DriveSettings, Inputs
from sysid.models.response.near_motion import Bodies
from sysid.models.response.rigid_bodies import RigidBodies
from sysid.models.response.segments import Segment, inputs_of
from sysid.models.response.simulation import Arm, ParameterSet, simulate
from tests.sysid.models.arm import JOINTS, write_two_link_arm

K, D = np.array([60.0, 25.0]), np.array([4.0, 1.5])
TIMES = np.linspace(0.0, 2.0, 401)


@pytest.fixture
def arm(tmp_path):
    urdf = write_two_link_arm(tmp_path / "two.urdf")
    return Arm(JOINTS, Bodies(RigidBodies(str(urdf), JOINTS), False))


def goal(t):
    return np.stack([0.5 * np.sin(3.0 * t), 0.4 * np.cos(2.0 * t)], axis=-1)


def segment(enabled=1.0, gain=1.0, supply=1.0, at=(0.1, 0.3), command=goal):
    one = np.ones((len(TIMES), 2))
    goal, none = command(TIMES), 0.0 * one
    inputs = Inputs(goal, none, gain * one, supply * one, enabled * one)
    return Segment(0.0, np.array(at), np.zeros(2), TIMES, inputs, np.zeros(2))


def parameters(*effects, delay=0.0, limit=np.inf, k=K, d=D):
    return ParameterSet(Drive(k, d, limit), delay, effects)


def run(arm, sets, segments, steps=400, h=0.005):
    return simulate(arm, sets, segments, steps, h)


def accelerations(arm, q, v, torque):
    terms = arm.bodies.terms(q[None], v[None], ())
    return np.linalg.solve(terms.M[0], torque - terms.bias[0])


def exact(arm, torque_at):
    """Drake's rigid bodies by an adaptive integrator of high order."""

    def slope(t, x):
        q, v = x[:2], x[2:]
        return np.concatenate([v, accelerations(arm, q, v, torque_at(t, q, v))])

    x = [0.1, 0.3, 0.0, 0.0]
    found = solve_ivp(slope, (0, 2), x, "DOP853", TIMES[::4], rtol=1e-10, atol=1e-12)
    return found.y[:2].T


def smooth_torque(t, q, v):
    goal_then = [np.interp(t, TIMES, column) for column in goal(TIMES).T]
    return K * (np.array(goal_then) - q) - (D + np.array([0.3, 0.2])) * v


@pytest.mark.slow
def test_it_converges_to_an_exact_solution_with_the_square_of_the_step(arm):
    reference = exact(arm, smooth_torque)
    friction = [
        JointViscousFriction(j, b) for j, b in zip(JOINTS, (0.3, 0.2), strict=True)
    ]
    errors = []
    for finer in (1, 2):
        motion = run(
            arm, [parameters(*friction)], [segment()], 400 * finer, 0.005 / finer
        )
        q = motion.q[:: 4 * finer, 0, 0]
        errors.append(np.abs(q - reference).max())
    assert errors[0] < 5e-4
    assert 3.0 < errors[0] / errors[1] < 5.0


def test_at_rest_spring_and_gravity_balance(arm):
    q_d = np.array([0.4, -0.2])
    still = segment(command=lambda t: np.tile(q_d, (len(t), 1)))
    motion = run(arm, [parameters()], [still], 1200, 0.01)
    q = motion.q[-1, 0]
    np.testing.assert_allclose(motion.v[-1], 0.0, atol=1e-6)
    np.testing.assert_allclose(K * (q_d - q), arm.bodies.arm.holding(q), atol=1e-5)
    compensated = Arm(arm.joints, Bodies(arm.bodies.arm, True))
    motion = run(compensated, [parameters()], [still], 1200, 0.01)
    np.testing.assert_allclose(motion.q[-1, 0, 0], q_d, atol=1e-6)


def test_dry_friction_holds_an_arm_that_is_off(arm):
    friction = [JointCoulombFriction(j, 50.0, 1e-4) for j in JOINTS]
    motion = run(arm, [parameters(*friction)], [segment(enabled=0.0)])
    assert np.abs(motion.v).max() < 1e-4
    assert np.abs(motion.q - motion.q[0]).max() < 2e-4


def test_an_arm_that_is_off_keeps_its_energy(arm):
    motion = run(arm, [parameters()], [segment(enabled=0.0)], 2000, 0.001)
    q, v = motion.q[:, 0, 0], motion.v[:, 0, 0]
    terms = arm.bodies.terms(q, np.zeros_like(q), ())
    kinetic = 0.5 * np.einsum("ni,nij,nj->n", v, terms.M, v)
    # What gravity has done, by the trapezoidal rule over the path.
    pull = -0.5 * (terms.bias[1:] + terms.bias[:-1])
    work = np.concatenate([[0.0], np.cumsum(np.sum(pull * np.diff(q, axis=0), axis=1))])
    assert np.ptp(work) > 0.1
    np.testing.assert_allclose(kinetic, work, atol=2e-3 * np.ptp(work))


def test_a_late_goal_is_the_same_goal_later(arm):
    late = segment(command=lambda t: goal(np.maximum(t - 0.04, 0.0)))
    delayed = run(arm, [parameters(delay=0.04)], [segment()])
    np.testing.assert_allclose(delayed.q, run(arm, [parameters()], [late]).q, atol=2e-4)


def test_gain_times_supply_times_stiffness_is_what_counts(arm):
    strong = run(arm, [parameters()], [segment(gain=2.0, supply=3.0)])
    same = run(arm, [parameters(k=6.0 * K)], [segment()])
    np.testing.assert_allclose(strong.q, same.q, atol=1e-12)


def test_a_saturated_drive_pulls_with_its_limit():
    drive = Drive(np.array([2.0]), np.array([0.5]), 0.1)
    one = np.ones((3, 1))
    goal = np.array([[0.05], [1.0], [-1.0]])
    inputs = Inputs(goal, 0.0 * one, one, one, one)
    torque = drive.torque(np.zeros((3, 1)), np.zeros((3, 1)), inputs)
    np.testing.assert_allclose(torque[:, 0], [0.1, 0.2, -0.2])


def test_damping_acts_on_the_error_of_the_velocity_if_the_drive_allows_for_it():
    episode = {"time": TIMES, "q_commanded": goal(TIMES)}
    drive, v = Drive(K, D, np.inf), np.full((len(TIMES), 2), 0.3)
    plain = inputs_of(episode, DriveSettings())
    forward = inputs_of(episode, DriveSettings(velocity_feedforward=True))
    added = drive.torque(0.0 * v, v, forward) - drive.torque(0.0 * v, v, plain)
    rate = [1.5 * np.cos(3.0 * TIMES), -0.8 * np.sin(2.0 * TIMES)]
    np.testing.assert_allclose(added / D, np.stack(rate, axis=1), atol=0.02)
    late = Segment(0.0, v[0], v[0], TIMES, forward, v[0])
    late = late.inputs_at(np.array([1.0]), 0.1)
    assert late.rate[0, 0] == pytest.approx(1.5 * np.cos(2.7), abs=1e-3)


def test_a_lane_that_fails_is_nan_and_the_others_go_on(arm):
    sets = [parameters(), parameters(k=np.array([np.inf, 1.0]))]
    with np.errstate(invalid="ignore"):
        motion = run(arm, sets, [segment()], 20)
    assert np.isfinite(motion.q[:, 0]).all()
    assert np.isnan(motion.q[-1, 1]).all()


FLANGE = """<link name="tool0"/><joint name="flange" type="fixed">
<parent link="lower"/><child link="tool0"/><origin xyz="0.1 -0.2 0.3" rpy="0.4 1 -2"/>
</joint>"""


def test_a_payload_takes_what_the_regressor_says(tmp_path):
    """Also on a flange that weighs nothing itself, as URDFs end in."""
    urdf = write_two_link_arm(tmp_path / "two.urdf")
    urdf.write_text(urdf.read_text().replace("</robot>", f"{FLANGE}</robot>"))
    arm = Arm(JOINTS, Bodies(RigidBodies(str(urdf), JOINTS), False))
    dynamics = ArmRegressor(str(urdf), JOINTS)
    payload = FlangePayload(0.7, 0.02, -0.03, 0.1)
    tilt = ArmTilt(0.02, -0.05)
    q, v, vd = np.random.default_rng(0).uniform(-2.0, 2.0, (3, 20, 2))
    Y, Y_tilt = dynamics.with_tilt(q, v, vd)
    by_payload = Y[:, :, dynamics.last_link] @ payload.inertial
    found = arm.bodies.terms(q, v, [payload]).load(vd)
    np.testing.assert_allclose(found, Y @ dynamics.inertia + by_payload, atol=1e-9)
    by_tilt = np.einsum("njkt,k,t->nj", Y_tilt, dynamics.inertia, [tilt.rx, tilt.ry])
    found = arm.bodies.terms(q, v, [tilt]).load(vd)
    np.testing.assert_allclose(found, Y @ dynamics.inertia + by_tilt, atol=1e-9)


def test_near_the_measured_motion_simulations_are_as_by_drake(arm):
    """Also of sets with a payload or a tilt, and of those that leave the motion."""
    sets = [
        parameters(JointViscousFriction(JOINTS[0], b), FlangePayload(m), ArmTilt(rx=r))
        for b, m, r in ((0.3, 0.0, 0.0), (0.0, 0.5, 0.0), (0.0, 0.0, 0.05), (8.0, 0, 0))
    ]
    wanted = run(arm, sets, [segment()])
    first = wanted.q[:, 0, 0], wanted.v[:, 0, 0]
    near = dataclasses.replace(segment(), measured=first)
    found = run(arm, sets, [near])
    away = np.abs(wanted.q - wanted.q[:, :1]).max(axis=(0, 2, 3))
    assert away[1] > 0.01 and away[3] > 0.1
    np.testing.assert_allclose(found.q, wanted.q, atol=2e-5)
    np.testing.assert_allclose(found.q[:, 1:3], wanted.q[:, 1:3], atol=1e-9)


def test_lanes_do_not_see_each_other(arm):
    """Dry friction takes many iterations; others are done long before."""
    sets = [
        parameters(
            JointCoulombFriction(JOINTS[0], dry, 1e-4),
            JointLoadFriction(JOINTS[0], c, 0.02),
            RotorInertia(JOINTS[1], c),
        )
        for dry, c in ((0.0, 0.0), (50.0, 0.1), (0.0, 0.4))
    ]
    segments = [segment(at=(0.1, 0.3)), segment(at=(-0.4, 0.2))]
    together = run(arm, sets, segments, 60)
    for i, own in enumerate(sets):
        for j, each in enumerate(segments):
            alone = run(arm, [own], [each], 60)
            np.testing.assert_allclose(together.q[:, i, j], alone.q[:, 0, 0], atol=1e-9)
