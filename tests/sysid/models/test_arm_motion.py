"""Effects that act on a whole arm: shifts in time, a tilted base, coupled joints."""

import numpy as np
import pytest
from pydrake.math import RotationMatrix
from pydrake.multibody.plant import MultibodyPlant

from drake_disasm.effects import (
    ArmDelay,
    ArmSamples,
    ArmTilt,
    Effect,
    JointCoulombFriction,
    JointCoupling,
    JointDelay,
    TorqueRipple,
)
from drake_disasm.logs import Log
from drake_disasm.scenario import Scenario
from sysid.effect_selection.close_loop import close_loop
from sysid.models.effects import at_null
from sysid.models.joint_motion import JointMotionModel
from sysid.models.regressor import ArmRegressor
from tests.sysid.models.arm import (
    JOINTS,
    smooth_motion,
    write_motion_log,
    write_two_link_arm,
)

_PERIOD, _ROWS = 0.01, 600
_NOISE = 0.02  # N m


def _log(folder, urdf, effects: list[Effect], seed: int = 0) -> Log:
    """Writes what a simulated arm with effects reads, with noise."""
    time = _PERIOD * np.arange(_ROWS)
    q, v, vd = smooth_motion(time)
    columns = {"time": time, "q": q, "v": v, "vd": vd, "tau": 5.0 * q}
    model = _model(write_motion_log(folder / "bare", urdf, columns), effects)
    random = np.random.default_rng(seed)
    columns["tau"] = _torque(model) + _NOISE * random.normal(size=q.shape)
    return write_motion_log(folder / "log", urdf, columns)


def _model(log: Log, effects: list[Effect]) -> JointMotionModel:
    return JointMotionModel([log], scenario=Scenario(effects=effects))


def _torque(model: JointMotionModel) -> np.ndarray:
    return model.predictions(np.array([p.nominal for p in model.parameters]))


@pytest.fixture
def urdf(tmp_path):
    return write_two_link_arm(tmp_path / "two.urdf")


def test_a_late_torque_is_that_of_an_earlier_motion(urdf, tmp_path):
    late, log = -0.0012, _log(tmp_path, urdf, [])
    time = log.episodes[0]["time"]
    arm = ArmRegressor(str(urdf), JOINTS)
    q, v, vd = smooth_motion(time - late)
    expected = arm.regressor(q, v, vd) @ arm.inertia
    inner = slice(5, -5)  # at its ends the log has no earlier or later motion
    found = _torque(_model(log, [ArmDelay(late)]))
    np.testing.assert_allclose(found[inner], expected[inner], atol=1e-3)
    of_one = _torque(_model(log, [JointDelay("elbow", late)]))
    without = _torque(_model(log, []))
    np.testing.assert_array_equal(of_one[:, 0], without[:, 0])
    np.testing.assert_array_equal(of_one[:, 1], found[:, 1])


def test_some_rows_are_predicted_as_in_the_whole_log(urdf, tmp_path):
    """A shift looks at neighbours that are held out themselves."""
    model = _model(_log(tmp_path, urdf, []), [ArmDelay(0.004)])
    mask = np.random.default_rng(0).random(_ROWS) < 0.3
    few = model.of_rows(mask)
    np.testing.assert_allclose(_torque(few), _torque(model)[mask], rtol=1e-12)
    fewer = few.of_rows(np.arange(mask.sum()) % 2 == 0)
    np.testing.assert_allclose(_torque(fewer), _torque(model)[mask][::2], rtol=1e-12)


def test_a_tilted_base_sees_another_gravity(urdf, tmp_path):
    log = _log(tmp_path, urdf, [])
    rx, ry = 1e-4, -2e-4
    found = _torque(_model(log, [ArmTilt(rx, ry)])) - _torque(_model(log, []))
    arm = ArmRegressor(str(urdf), JOINTS)
    before = arm.random_regressor() @ arm.inertia
    plant: MultibodyPlant = arm._plant
    R_WB = RotationMatrix.MakeXRotation(rx) @ RotationMatrix.MakeYRotation(ry)
    plant.mutable_gravity_field().set_gravity_vector(R_WB.inverse() @ [0, 0, -9.81])
    assert np.abs(arm.random_regressor() @ arm.inertia - before).max() > 1e-4
    motion = (log.episodes[0][name] for name in ("q", "v", "vd"))
    expected = arm.regressor(*motion) @ arm.inertia - _torque(_model(log, []))
    np.testing.assert_allclose(found, expected, atol=1e-6)


def test_a_coupled_motor_turns_with_both_joints():
    effect = JointCoupling("a", inertia=2.0, viscous=3.0, dry=5.0, creep=1e-3)
    zero = np.zeros((1, 3))
    samples = ArmSamples(
        ("a", "b", "c"), zero, np.array([[1.0, -0.5, 9.0]]), np.array([[1, 10, 9.0]]),
        zero,
    )  # fmt: skip
    np.testing.assert_allclose(
        effect.torques(samples), [[20 - 1.5 + 5, 2 + 3 + 5, 0.0]]
    )
    assert [e.joint for e in at_null(JointCoupling, ("a", "b", "c"))] == ["a", "b"]


def test_ripple_repeats_itself():
    effect = TorqueRipple("a", sine=2.0, cosine=3.0, periods=4.0)
    q = np.array([[0.0], [np.pi / 8], [np.pi / 2]])
    zero = np.zeros_like(q)
    found = effect.torques(ArmSamples(("a",), q, zero, zero, zero))
    np.testing.assert_allclose(found[:, 0], [3.0, 2.0, 3.0], atol=1e-12)


@pytest.mark.parametrize(
    ("effects", "expected"),
    [
        ([JointDelay("elbow", -0.01)], ("JointDelay.elbow",)),
        ([JointCoupling("shoulder", dry=0.2)], ("JointCoupling.shoulder",)),
        ([TorqueRipple("elbow", sine=0.1, periods=8.0)], ("TorqueRipple.elbow",)),
        (
            [ArmDelay(0.002), JointCoulombFriction("elbow", 0.2)],
            ("ArmDelay", "JointCoulombFriction.elbow"),
        ),
    ],
)
def test_closing_the_loop_names_them(effects, expected, urdf, tmp_path):
    found = close_loop(JointMotionModel([_log(tmp_path, urdf, effects)]))
    assert set(found.verdict.names) == set(expected)
    values = {v.name.rpartition(".")[2]: v.value for v in found.verdict.values}
    if hasattr(effects[0], "delay"):
        assert values["delay"] == pytest.approx(effects[0].delay, rel=0.1)
