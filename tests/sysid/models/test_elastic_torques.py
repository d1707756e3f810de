"""A gear that yields: motor-side positions, and the torque at the joint."""

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline

from drake_disasm.effects import Effect, JointElasticity
from drake_disasm.logs import Log
from drake_disasm.scenario import Scenario
from sysid.effect_selection.close_loop import close_loop
from sysid.models.joint_motion import JointMotionModel
from sysid.models.link_torques import time_derivatives
from sysid.models.regressor import ArmRegressor
from tests.sysid.models.arm import (
    JOINTS,
    smooth_motion,
    write_motion_log,
    write_two_link_arm,
)

_PERIOD, _ROWS = 0.005, 1200
_NOISE = 0.02  # N m

_PENDULUM = """<robot name="pendulum"><link name="base"/><link name="rod">
<inertial><origin xyz="0 0 -0.4"/><mass value="5"/>
<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.01"/></inertial></link>
<joint name="pivot" type="revolute"><parent link="base"/><child link="rod"/>
<axis xyz="0 1 0"/><limit lower="-9" upper="9" velocity="9" effort="99"/></joint>
</robot>
"""


@pytest.fixture
def urdf(tmp_path):
    return write_two_link_arm(tmp_path / "two.urdf")


def _behind_springs(folder, urdf, compliances) -> Log:
    """A log of the arm whose links move smoothly: the motors lead by c tau.

    Link positions are a flat output of elastic joints (De Luca and Book, Springer
    Handbook of Robotics, 2nd ed., ch. 11): torque and motors follow without a
    simulation.
    """
    time = _PERIOD * np.arange(_ROWS)
    linked = smooth_motion(time)
    tau = ArmRegressor(str(urdf), JOINTS).torques(*linked)
    ahead = make_interp_spline(time, tau * compliances, k=5)
    q, v, vd = (part + ahead.derivative(k)(time) for k, part in enumerate(linked))
    noise = _NOISE * np.random.default_rng(0).normal(size=tau.shape)
    columns = {"time": time, "q": q, "v": v, "vd": vd, "tau": tau + noise}
    return write_motion_log(folder, urdf, columns)


def _torque(log: Log, effects: list[Effect]) -> np.ndarray:
    model = JointMotionModel([log], scenario=Scenario(effects=effects))
    return model.predictions(np.array([p.nominal for p in model.parameters]))


def test_a_pendulum_on_a_spring_swings_as_in_the_textbook(tmp_path):
    """J q'' + m g l sin(q) = tau = k (q_motor - q), in closed form.

    With q = a sin(w t), its torque's derivatives by hand.
    """
    path = tmp_path / "pendulum.urdf"
    path.write_text(_PENDULUM)
    time = _PERIOD * np.arange(_ROWS)
    a, w, J, weight, k = 0.5, 7.0, 0.1 + 5 * 0.4**2, 5 * 9.81 * 0.4, 2000.0
    q, v = a * np.sin(w * time), a * w * np.cos(w * time)
    vd = -(w**2) * q
    tau = J * vd + weight * np.sin(q)
    rate = -J * w**2 * v + weight * np.cos(q) * v
    second = -J * w**2 * vd + weight * (np.cos(q) * vd - np.sin(q) * v**2)
    motor = [x + y / k for x, y in zip((q, v, vd), (tau, rate, second), strict=True)]
    columns = dict(zip(("q", "v", "vd"), (m[:, None] for m in motor), strict=True))
    columns |= {"time": time, "tau": tau[:, None]}
    log = write_motion_log(tmp_path / "log", path, columns, ("pivot",))
    rigid = _torque(log, [])
    change = _torque(log, [JointElasticity("pivot", 1.0 / k)]) - rigid
    inner = slice(20, -20)
    found = float(np.vdot(change[inner], (tau[:, None] - rigid)[inner]))
    found /= float(np.vdot(change[inner], change[inner]))
    assert found == pytest.approx(1.0, abs=0.03)  # times the true compliance


def test_it_is_affine_in_the_compliance_and_of_any_rows(urdf, tmp_path):
    log = _behind_springs(tmp_path / "log", urdf, [0.0, 0.0])
    rigid = _torque(log, [])
    change = _torque(log, [JointElasticity("shoulder", 1e-3)]) - rigid
    twice = _torque(log, [JointElasticity("shoulder", 2e-3)]) - rigid
    assert np.abs(change).max(axis=0).min() > 1e-3  # both joints feel it
    np.testing.assert_allclose(twice, 2.0 * change, rtol=1e-9, atol=1e-12)
    scenario = Scenario(effects=[JointElasticity("shoulder", 1e-3)])
    model = JointMotionModel([log], scenario=scenario)
    theta = np.array([p.nominal for p in model.parameters])
    mask = np.random.default_rng(0).random(_ROWS) < 0.3
    few = model.of_rows(mask)
    np.testing.assert_allclose(few.predictions(theta), (rigid + change)[mask])
    fewer = few.of_rows(np.arange(mask.sum()) % 2 == 0)
    np.testing.assert_allclose(fewer.predictions(theta), (rigid + change)[mask][::2])


def test_time_derivatives_of_noise_stay_small():
    time = 1e-3 * np.arange(2000)
    noise = 1e-3 * np.random.default_rng(0).normal(size=2000)
    wave = np.sin(20.0 * time)
    found = time_derivatives(time, wave + noise)
    inner = slice(60, -60)
    np.testing.assert_allclose(found[0, inner], 20 * np.cos(20 * time)[inner], atol=0.1)
    np.testing.assert_allclose(found[1, inner], -400 * wave[inner], atol=12.0)
    assert not time_derivatives(time[:5], wave[:5]).any()


def test_closing_the_loop_names_the_joint(urdf, tmp_path):
    """Its size to a tenth: the motion is at a fifth of the joint's resonance."""
    log = _behind_springs(tmp_path / "log", urdf, [1e-3, 0.0])
    verdict = close_loop(JointMotionModel([log])).verdict
    assert verdict.names == ("JointElasticity.shoulder",)
    (value,) = verdict.values
    assert value.value == pytest.approx(1e-3, rel=0.15)


def test_a_stiff_arm_is_given_none(urdf, tmp_path):
    log = _behind_springs(tmp_path / "log", urdf, [0.0, 0.0])
    assert close_loop(JointMotionModel([log])).verdict.names == ()
