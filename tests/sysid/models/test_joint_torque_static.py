"""Torques of arms at rest, against Drake's gravity and a pendulum's."""

from pathlib import Path

import numpy as np
import pytest

import drake_disasm.effects as fx
from drake_disasm.scenario import Scenario
from sysid.models.from_logs import ModelChoice, model_of
from sysid.models.joint_torque_static import JointTorqueStaticModel, arrivals
from sysid.scenario_parameters import ParameterRequest
from tests.refusals import refused
from tests.sysid.models.arm import JOINTS, write_motion_log, write_two_link_arm
from tests.sysid.models.rests import (
    GRAVITY,
    IIWA,
    IIWA_JOINTS,
    from_both_sides,
    iiwa_poses,
    iiwa_weight,
    write_rests,
)

MASS, LENGTH = 2.0, 0.5
MOMENT = MASS * GRAVITY * LENGTH  # N m, held out level
PENDULUM = f"""<robot name="pendulum"><link name="wall"/>
<link name="rod"><inertial><origin xyz="0 0 -{LENGTH}"/><mass value="{MASS}"/>
<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
<joint name="pivot" type="revolute"><parent link="wall"/><child link="rod"/>
<axis xyz="0 1 0"/><limit lower="-3" upper="3" velocity="3" effort="99"/></joint>
</robot>"""


@pytest.fixture
def pendulum(tmp_path: Path) -> Path:
    """A rod that hangs along -z at q = 0, and turns about y."""
    path = tmp_path / "pendulum.urdf"
    path.write_text(PENDULUM)
    return path


def swings(count: int = 20) -> np.ndarray:
    """Returns poses (4 count, 1), each reached from both sides."""
    random = np.random.default_rng(0)
    return from_both_sides(random.uniform(-2.0, 2.0, (count, 1)), random)


def model_with(folder, urdf, effects=(), tau=None) -> JointTorqueStaticModel:
    q = swings()
    log = write_rests(folder, urdf, ["pivot"], q, np.sin(q) if tau is None else tau)
    model = model_of([log], ModelChoice(scenario=Scenario(effects=list(effects))))
    assert isinstance(model, JointTorqueStaticModel)
    return model


def nominal(model) -> np.ndarray:
    return model.predictions(np.array([p.nominal for p in model.parameters]))


def test_a_pendulum_is_held_by_its_weight(pendulum, tmp_path):
    model = model_with(tmp_path / "log", pendulum)
    np.testing.assert_allclose(nominal(model), MOMENT * np.sin(swings()), atol=1e-9)
    assert [p.unit for p in model.parameters] == ["kg m"] * 2  # along x and along z


def test_the_iiwa_is_held_by_what_drake_says_and_shows_no_inertias(tmp_path):
    q = iiwa_poses(3, seed=0)
    log = write_rests(tmp_path / "log", IIWA, IIWA_JOINTS, q, np.cos(q))
    model = model_of([log], ModelChoice())
    np.testing.assert_allclose(nominal(model), iiwa_weight(q), atol=1e-9)
    assert len(model.parameters) == 12  # the arm stands upright: none of joint 1
    assert not any(".I" in p.doc for p in model.parameters)
    with refused("at rest", "inertias"):
        model_of([log], ModelChoice(requests=(ParameterRequest("iiwa_link_3.Izz"),)))


def test_half_the_difference_from_both_sides_is_friction_and_the_mean_weight(
    pendulum, tmp_path
):
    c, q = 0.7, swings()
    tau = nominal(
        model_with(tmp_path / "log", pendulum, [fx.JointCoulombFriction("pivot", c)])
    )
    one, other = tau[1::4], tau[3::4]  # the same pose from either side
    came = np.sign(q[1::4] - q[::4])
    np.testing.assert_allclose(0.5 * (one - other), c * came, atol=1e-9)
    np.testing.assert_allclose(0.5 * (one + other), MOMENT * np.sin(q[1::4]), atol=1e-9)


def test_friction_per_load_grows_with_the_weight(pendulum, tmp_path):
    q, bare = swings(), model_with(tmp_path / "bare", pendulum)
    effect = fx.JointLoadFriction("pivot", 0.1)
    added = nominal(model_with(tmp_path / "log", pendulum, [effect])) - nominal(bare)
    expected = 0.1 * np.abs(MOMENT * np.sin(q)) * arrivals(q)
    np.testing.assert_allclose(added, expected, atol=1e-9)


def test_a_gear_yields_under_the_weight_alone(pendulum, tmp_path):
    """To first order by -c tau dtau/dq, whatever the order of the poses."""
    c, q, bare = 1e-4, swings(), model_with(tmp_path / "bare", pendulum)
    effect = fx.JointElasticity("pivot", c)
    added = nominal(model_with(tmp_path / "log", pendulum, [effect])) - nominal(bare)
    expected = -c * MOMENT**2 * np.sin(q) * np.cos(q)
    np.testing.assert_allclose(added, expected, atol=1e-6)


@pytest.mark.parametrize(
    "effect",
    [
        fx.JointViscousFriction("pivot", 3.0),
        fx.JointStribeckFriction("pivot", 3.0),
        fx.JointAsymmetricFriction("pivot", 3.0),
        fx.JointDahlFriction("pivot", 3.0),
        fx.RotorInertia("pivot", 3.0),
        fx.ArmDelay(0.05),
    ],
    ids=lambda effect: type(effect).__name__,
)
def test_what_needs_motion_is_nothing_at_rest(effect, pendulum, tmp_path):
    bare = nominal(model_with(tmp_path / "bare", pendulum))
    with_it = nominal(model_with(tmp_path / "log", pendulum, [effect]))
    np.testing.assert_array_equal(with_it, bare)


def test_a_joint_comes_from_where_it_was_in_the_pose_before():
    q = np.array(
        [
            [0.0, 0.0],
            [0.5, 0.0],  # the second has not moved
            [0.5, 1e-4],  # noise of encoders: the same pose, read again
            [0.2, 0.3],
            [0.2, -0.1],
        ]
    )
    expected = [[0, 0], [1, 0], [1, 0], [-1, 1], [0, -1]]
    np.testing.assert_array_equal(arrivals(q), expected)


def test_episodes_begin_anew_and_rows_keep_the_side_they_were_reached_from(tmp_path):
    urdf = write_two_link_arm(tmp_path / "two.urdf")
    q = from_both_sides(np.ones((3, 2)), np.random.default_rng(0))
    logs = [
        write_rests(tmp_path / name, urdf, JOINTS, q, np.cos(q)) for name in ("a", "b")
    ]
    rubbing = Scenario(effects=[fx.JointCoulombFriction("elbow", 1.0)])
    rubs, bare = (
        model_of(logs, ModelChoice(scenario=each)) for each in (rubbing, Scenario())
    )
    added = nominal(rubs) - nominal(bare)
    both = np.tile(arrivals(q)[:, 1], 2)
    np.testing.assert_allclose(added, np.column_stack([0 * both, both]), atol=1e-9)
    odd = np.arange(len(both)) % 2 == 1
    np.testing.assert_allclose(
        nominal(rubs.of_rows(odd)) - nominal(bare.of_rows(odd)), added[odd], atol=1e-9
    )


def test_refuses_a_log_of_motion(tmp_path):
    urdf = write_two_link_arm(tmp_path / "two.urdf")
    still = np.zeros((4, 2))
    log = write_motion_log(
        tmp_path / "log", urdf, {"time": np.arange(4.0), "q": still, "tau": still}
    )
    with refused("'joint_motion'", "'joint_torque_static'"):
        JointTorqueStaticModel([log])


def test_a_base_on_the_wall_is_seen_in_torques_at_rest(tmp_path):
    """By fits in which velocities, and all torques of motion, are columns of zeros."""
    q = iiwa_poses(40, seed=0)
    tau = iiwa_weight(q, gravity=(GRAVITY, 0.0, 0.0))
    tau += 0.1 * np.random.default_rng(5).standard_normal(tau.shape)
    log = write_rests(tmp_path / "log", IIWA, IIWA_JOINTS, q, tau)
    [way] = model_of([log], ModelChoice()).bookkeeping()
    assert way.name == "GravityDirection" and "by 90 degrees" in way.what


def test_positions_in_degrees_are_known_at_rest(tmp_path):
    q = iiwa_poses(10, seed=0)
    log = write_rests(
        tmp_path / "log", IIWA, IIWA_JOINTS, np.degrees(q), iiwa_weight(q)
    )
    [way] = model_of([log], ModelChoice()).bookkeeping()
    np.testing.assert_allclose(nominal(way.model), iiwa_weight(q), atol=1e-9)
