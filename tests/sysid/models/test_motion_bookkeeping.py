"""Ways to write an arm's log wrongly, of logs that are right but for that."""

import numpy as np
import pytest
from damaged_logs import damaged, late, reordered, scaled, swapped

from drake_disasm.effects import JointCoulombFriction, JointViscousFriction
from drake_disasm.logs import Log, read_log
from sysid.effect_selection.close_loop import close_loop
from sysid.models.from_logs import ModelChoice, model_of
from sysid.models.joint_motion import JointMotionModel
from sysid.models.motion_bookkeeping import TorqueFits
from sysid.models.regressor import ArmRegressor
from sysid.models.signed_order import SignedOrder
from sysid.parameters import nominal_values
from tests.sysid.models.arm import JOINTS, write_motion_log, write_two_link_arm
from tests.sysid.real_data import write_arm, write_emps, write_motion, write_slide

_G, _DEGREES = 9.81, 180.0 / np.pi
_SWINGS = ([(0.8, 3.0), (0.3, 7.1)], [(0.9, 4.3), (0.2, 9.7)])  # rad, rad/s


def motion(time):
    q, v, vd = np.zeros((3, len(time), 2))
    for joint, pairs in enumerate(_SWINGS):
        for size, omega in pairs:
            phase = omega * time
            q[:, joint] += size * np.sin(phase)
            v[:, joint] += size * omega * np.cos(phase)
            vd[:, joint] -= size * omega**2 * np.sin(phase)
    return q, v, vd


def write(folder, gravity=None, lateness=0.0, friction=1.0) -> Log:
    """Writes a log with friction and noise, of an arm that stands in any way."""
    folder.mkdir(exist_ok=True)
    urdf = write_two_link_arm(folder / "two.urdf")
    time = 0.01 * np.arange(800)
    arm = ArmRegressor(str(urdf), JOINTS, gravity)
    q, v, vd = motion(time - lateness)
    tau = arm.regressor(q, v, vd) @ arm.inertia
    tau += friction * (0.3 * np.sign(v) + 0.1 * v)
    tau += 0.02 * np.random.default_rng(0).standard_normal(tau.shape)
    columns = dict(zip(("q", "v", "vd"), motion(time), strict=True))
    return write_motion_log(folder / "log", urdf, {"time": time, **columns, "tau": tau})


@pytest.fixture(scope="module")
def right(tmp_path_factory) -> Log:
    return write(tmp_path_factory.mktemp("arm"))


def model(log: Log) -> JointMotionModel:
    found = model_of([log], ModelChoice())
    assert isinstance(found, JointMotionModel)
    return found


def test_a_right_log_has_no_other_way(right):
    assert model(right).bookkeeping() == []


@pytest.mark.parametrize(
    ("name", "damage", "words"),
    [
        ("TorqueSign.elbow", scaled(-1.0, "tau.1"), "tau.1 (elbow) has the other sign"),
        ("TorqueSign", scaled(-1.0, "tau"), "all joints"),
        ("JointOrder", swapped("tau.0", "tau.1"), "tau.1 is that of shoulder"),
        ("JointOrder", swapped("tau.0", "tau.1", -1.0), "-tau.0 is that of elbow"),
        ("TorqueUnit.elbow", scaled(1e3, "tau.1"), "1000 times"),
    ],
)
def test_columns_of_torques_are_put_right(name, damage, words, right):
    [way] = model(damaged(right, damage)).bookkeeping()
    assert way.name == name and words in way.what and way.remedy
    expected = model(right).measurements.values
    np.testing.assert_allclose(way.model.measurements.values, expected, rtol=1e-9)


def test_closing_the_loop_takes_a_sign_for_the_log_s_and_names_what_is_besides(right):
    library = [JointCoulombFriction, JointViscousFriction]
    turned = model(damaged(right, scaled(-1.0, "tau.1")))
    verdict = close_loop(turned, library=library).verdict
    assert [each.name for each in verdict.written] == ["TorqueSign.elbow"]
    rightly = close_loop(model(right), library=library).verdict
    assert not rightly.written and set(verdict.names) == set(rightly.names)
    assert {name.partition(".")[0] for name in rightly.names} == {
        "JointCoulombFriction",
        "JointViscousFriction",
    }


@pytest.mark.parametrize(
    ("name", "damage", "words"),
    [
        ("PositionUnit", scaled(_DEGREES, "q", "v"), "in degrees"),
        ("PositionUnit", scaled(_DEGREES, "q"), "in degrees"),
        ("VelocityFactor", scaled(_DEGREES, "v."), "as in degrees"),
        ("VelocityFactor.elbow", scaled(30.0 / np.pi, "v.1"), "turns a minute"),
        ("VelocityFactor.shoulder", scaled(1.1, "v.0", "vd.0"), "1.1 times"),
        ("VelocityFactor.shoulder", scaled(-1.0, "v.0"), "other sign"),
        ("AccelerationFactor.elbow", scaled(0.5, "vd.1"), "0.5"),
    ],
)
def test_rates_and_units_are_put_right(name, damage, words, right):
    [way] = model(damaged(right, damage)).bookkeeping()
    assert way.name == name and words in way.what
    expected = model(right)
    theta = nominal_values(expected.parameters)
    torques = expected.predictions(theta)
    error = way.model.predictions(theta) - torques
    assert np.abs(error).max() < 1e-2 * np.abs(torques).max()
    for own, other in zip(way.model.parameters, expected.parameters, strict=True):
        assert own.name == other.name
        assert own.high == pytest.approx(other.high, rel=1e-2, abs=1e-6)


def test_a_delay_of_all_torques_is_estimated_between_samples(tmp_path):
    log = write(tmp_path, lateness=0.037)
    [way] = model(log).bookkeeping()
    assert way.name == "CommonDelay" and way.estimated == 1
    [effect] = way.model.effects
    assert effect.delay == pytest.approx(0.037, abs=1e-3)
    assert [p.name for p in way.model.parameters] == [
        p.name for p in model(log).parameters
    ]


def test_a_delay_of_one_joint_is_not_common(right):
    assert model(damaged(right, late(3, "tau.1"))).bookkeeping() == []


@pytest.mark.parametrize(
    "gravity", [(0.0, 0.0, _G), (_G, 0.0, 0.0), (0.0, -0.8 * _G, -0.6 * _G)]
)
def test_a_base_that_is_mounted_otherwise(gravity, tmp_path):
    [way] = model(write(tmp_path, gravity)).bookkeeping()
    assert way.name == "GravityDirection" and way.estimated == 2
    cosine = np.dot(way.model._gravity, gravity) / _G**2
    assert cosine > np.cos(np.radians(3.0))
    angle = np.degrees(np.arccos(-gravity[2] / _G))
    assert f"turned by {angle:.0f} degrees" in way.what


def test_opposite_torques_without_friction_are_no_hanging_arm(tmp_path):
    log = write(tmp_path, friction=0.0)
    assert model(log).bookkeeping() == []
    [way] = model(damaged(log, scaled(-1.0, "tau"))).bookkeeping()
    assert way.name == "TorqueSign"
    [way] = model(write(tmp_path / "up", (0.0, 0.0, _G), friction=0.0)).bookkeeping()
    assert way.name == "GravityDirection"


def test_torques_without_gravity_are_explained_by_a_model_without(tmp_path):
    log = write(tmp_path, (0.0, 0.0, 0.0))
    [way] = model(log).bookkeeping()
    assert way.name == "GravityRemoved"
    assert len(way.model.parameters) < len(model(log).parameters)
    arm = way.model
    still = arm.predictions(nominal_values(arm.parameters))
    q, v, vd = motion(0.01 * np.arange(800))
    weightless = ArmRegressor(log.header.urdf, JOINTS, (0.0, 0.0, 0.0))
    np.testing.assert_allclose(still, weightless.torques(q, v, vd), atol=1e-9)


def test_ways_are_those_of_the_rows_that_a_model_has(right):
    kept = np.arange(800) < 600
    whole = model(damaged(right, scaled(-1.0, "v.0")))
    [way] = whole.of_rows(kept).bookkeeping()
    assert way.name == "VelocityFactor.shoulder"
    theta = nominal_values(way.model.parameters)
    error = way.model.predictions(theta) - model(right).predictions(theta)[:600]
    assert np.abs(error).max() < 1e-2


@pytest.mark.parametrize("rows", [1, 2, 5, 30])
def test_few_rows_tell_nothing(rows, right):
    few = model(damaged(right, scaled(-1.0, "tau"))).of_rows(np.arange(800) < rows)
    assert few.bookkeeping() == []


@pytest.mark.parametrize("columns", ["tau", "q.1 v.1 vd.1", "q v vd"])
def test_columns_of_zeros_are_no_other_way(columns, right):
    log = damaged(right, scaled(0.0, *columns.split()))
    assert model(log).bookkeeping() == []


def test_a_frozen_parameter_stays_frozen(right):
    log = damaged(right, scaled(2.0, "v.0"))
    name = model(log).parameters[0].name
    [way] = model(log).freeze({name: 1.0}).bookkeeping()
    assert name not in [p.name for p in way.model.parameters]
    assert np.isfinite(
        way.model.predictions(nominal_values(way.model.parameters))
    ).all()


@pytest.mark.parametrize(
    ("order", "sign", "steps"),
    [
        ((0, 1, 2), (1.0, 1.0, 1.0), 0),
        ((0, 1, 2), (-1.0, -1.0, -1.0), 1),
        ((0, 1, 2), (1.0, -1.0, 1.0), 1),
        ((2, 1, 0), (1.0, 1.0, 1.0), 1),
        ((1, 2, 0), (1.0, -1.0, 1.0), 3),
    ],
)
def test_steps_of_an_order(order, sign, steps):
    found = SignedOrder(order, sign)
    assert found.steps == steps
    columns = np.array([1.0, 10.0, 100.0])
    expected = [s * columns[i] for i, s in zip(order, sign, strict=True)]
    np.testing.assert_allclose(found.matrix @ columns, expected)
    assert all(abs(near.steps - steps) <= 2 for near in found.near())


@pytest.mark.slow
def test_a_real_drive_is_written_right_but_for_its_clocks(tmp_path):
    urdf = write_slide(tmp_path / "emps.urdf")
    [way] = model(read_log(write_emps(2, tmp_path / "log", urdf))).bookkeeping()
    assert way.name == "CommonDelay"  # under a millisecond: README of the data
    assert abs(way.model.effects[0].delay) < 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("recording", [1, 2])
def test_a_real_arm_is_written_right(recording, tmp_path):
    urdf = write_arm(tmp_path / "arm.urdf")
    log = read_log(write_motion(recording, tmp_path / "log", urdf))
    assert model(log).bookkeeping() == []
    turned = model(damaged(log, scaled(-1.0, "tau.2")))
    assert [way.name for way in turned.bookkeeping()] == ["TorqueSign.lwr_2_joint"]


@pytest.fixture(scope="module")
def real_arm(tmp_path_factory) -> Log:
    """Every third row: an order takes seconds to find in all of them."""
    folder = tmp_path_factory.mktemp("lwr4")
    log = read_log(write_motion(1, folder / "log", write_arm(folder / "arm.urdf")))
    return damaged(log, lambda columns: columns.update(_every_third(columns)))


def _every_third(columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {name: values[::3] for name, values in columns.items()}


@pytest.mark.parametrize("order", [(6, 0, 1, 2, 3, 4, 5), (3, 1, 2, 0, 4, 5, 6)])
def test_columns_of_a_real_arm_are_put_back(order, real_arm):
    written = model(damaged(real_arm, reordered(np.argsort(order))))
    assert written.signed_order == SignedOrder(order, (1.0,) * 7)


def test_seconds_of_a_real_arm_tell_no_order(real_arm):
    whole = model(real_arm)
    time = whole._motion.time
    for start in range(0, 24, 2):
        part = whole.of_rows((time >= start) & (time < start + 2))
        assert part.signed_order == SignedOrder.as_written(7)


def test_a_wrong_sign_takes_no_gravity_away(real_arm):
    written = model(damaged(real_arm, scaled(-1.0, "tau.1")))
    fits = TorqueFits(written._motion, written.measurements.values)
    assert fits.gravity(written._arm_under, np.array([0.0, 0.0, -_G])) is None


def test_an_arm_that_stands_still_is_written_no_other_way(right):
    still = damaged(right, scaled(0.0, "v", "vd"))
    at_rest = damaged(still, scaled(0.0, "q"))
    assert model(at_rest).signed_order == SignedOrder.as_written(2)
