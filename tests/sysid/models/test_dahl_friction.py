"""Pre-sliding friction and a spring in logs of an arm's torques."""

import numpy as np
import pytest

from drake_disasm.effects import (
    ArmDelay,
    JointCoulombFriction,
    JointDahlFriction,
    JointDelay,
    JointSpring,
    TorqueOffset,
)
from drake_disasm.logs import LogHeader, LogWriter, flat_columns, read_log
from drake_disasm.scenario import Scenario
from sysid.models.joint_motion import JointMotionModel
from sysid.models.path_memory import PathMemory
from sysid.models.regressor import ArmRegressor
from tests.sysid.models.arm import JOINTS, smooth_motion, write_two_link_arm
from tests.sysid.models.fitted import fitted

PERIOD, ROWS, NOISE = 0.005, 1000, 0.02  # s, N m
SLOW = 0.25  # of the smooth motion's speed


@pytest.fixture
def urdf(tmp_path):
    return write_two_link_arm(tmp_path / "two.urdf")


def _log(folder, urdf, episodes=1, friction=(0.0, 0.002), spring=(0.0, 0.0)):
    """Torques of the arm with Dahl's friction, integrated in small steps, at its elbow.

    The reference: F follows dF/dq = (F_c sgn(dq) - F) / x_s by Euler's rule.
    """
    header = LogHeader("joint_motion", "excite", {}, joints=JOINTS, urdf=str(urdf))
    random = np.random.default_rng(0)
    fine = np.arange(50 * ROWS) * PERIOD / 50
    size, slip = friction
    with LogWriter(folder, header) as writer:
        for number in range(episodes):
            q, v, vd = smooth_motion(SLOW * (fine + number))
            F = np.zeros(len(fine))
            for k, dq in enumerate(np.diff(q[:, 1])):
                F[k + 1] = F[k] + (size * abs(dq) / dq - F[k]) * abs(dq) / slip
            q, v, vd = (x[::50] * SLOW**n for n, x in enumerate((q, v, vd)))
            tau = ArmRegressor(str(urdf), JOINTS).torques(q, v, vd)
            tau[:, 1] += F[::50] + spring[0] * q[:, 1] + spring[1]
            tau += NOISE * random.normal(size=tau.shape)
            columns = {"time": fine[::50], "q": q, "v": v, "vd": vd, "tau": tau}
            writer.write_episode(flat_columns("joint_motion", columns))
    return read_log(folder)


def test_least_squares_get_its_size_back_and_rivals_do_not_fit(urdf, tmp_path):
    log = _log(tmp_path / "log", urdf, friction=(0.6, 0.05))
    (size,), left = fitted(log, [JointDahlFriction("elbow", 1.0, 0.05)])
    assert size == pytest.approx(0.6, rel=0.02)
    assert left == pytest.approx(NOISE, rel=0.05)
    for creep in (0.005, 0.02, 0.08):
        rival = JointCoulombFriction("elbow", 1.0, creep)
        assert fitted(log, [rival])[1] > 2.0 * NOISE


def test_a_spring_is_got_back_besides_gravity(urdf, tmp_path):
    log = _log(tmp_path / "log", urdf, spring=(1.5, -0.4))
    effects = [JointSpring("elbow", 1.0), TorqueOffset("elbow", 1.0)]
    found, left = fitted(log, effects)
    np.testing.assert_allclose(found, [1.5, -0.4], rtol=0.03)
    assert left == pytest.approx(NOISE, rel=0.05)


def test_some_rows_know_the_whole_path(urdf, tmp_path):
    """Held-out rows are on the path; thinned twice, and with a shift in time."""
    log = _log(tmp_path / "log", urdf, episodes=2)
    dahl = JointDahlFriction("elbow", 0.7, 0.03)
    for effects in ([dahl], [dahl, ArmDelay(0.004)], [dahl, JointDelay("elbow", 0.01)]):
        model = JointMotionModel([log], scenario=Scenario(effects=effects))
        theta = np.array([p.nominal for p in model.parameters])
        whole = model.predictions(theta)
        mask = np.random.default_rng(0).random(len(whole)) < 0.3
        few = model.of_rows(mask)
        np.testing.assert_allclose(few.predictions(theta), whole[mask], rtol=1e-12)
        fewer = few.of_rows(np.arange(mask.sum()) % 2 == 0)
        found = fewer.predictions(theta)
        np.testing.assert_allclose(found, whole[mask][::2], rtol=1e-12)
    second = model.of_episodes([1])._motion
    of_elbow = second.paths.of(dahl)[second.row]
    np.testing.assert_array_equal(of_elbow, dahl.along(second.q[:, 1]))
    assert of_elbow[0] == 0.0


def test_a_joint_that_moves_one_way_does_not_offer_it(urdf, tmp_path):
    model = JointMotionModel([_log(tmp_path / "log", urdf)])
    offered = model.applicable_effects([JointDahlFriction])
    assert {e.joint for e in offered} == set(JOINTS)
    forth = model.of_rows(model._motion.v[:, 0] > 0.0)
    offered = forth.applicable_effects([JointDahlFriction])
    assert {e.joint for e in offered} == {"elbow"}


def test_memories_of_a_fit_do_not_pile_up():
    q = np.sin(np.linspace(0.0, 5.0, 30))[:, None]
    memory = PathMemory(["a"], np.repeat([0, 1], 15), q)
    first = memory.of(JointDahlFriction("a", 1.0, 0.05))
    for slip in np.linspace(0.01, 0.02, 200):
        memory.of(JointDahlFriction("a", 1.0, slip))
    assert len(memory._known) <= 64
    again = memory.of(JointDahlFriction("a", 2.0, 0.05))
    np.testing.assert_array_equal(again, first)
