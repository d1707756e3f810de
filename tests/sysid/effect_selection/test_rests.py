"""What hidden effects leave in torques at rest, by the name that the loop gives it."""

import numpy as np
import pytest

from sysid.data_checks import check_data
from sysid.effect_selection.close_loop import close_loop
from sysid.models.from_logs import ModelChoice, model_of
from sysid.models.joint_torque_static import arrivals
from sysid.scenario_parameters import ParameterRequest
from tests.sysid.models.arm import JOINTS, write_two_link_arm
from tests.sysid.models.rests import (
    GRAVITY,
    IIWA,
    IIWA_JOINTS,
    from_both_sides,
    iiwa_poses,
    iiwa_weight,
    write_rests,
)

NOISE = 0.1  # N m, of the iiwa's torque sensors
SHOULDER, ELBOW = 1, 3
OF_MOTION = {"JointViscousFriction", "RotorInertia", "JointDahlFriction", "ArmDelay"}


def named(verdict) -> set[str]:
    """Returns all that a verdict names, or has in a set."""
    ties = {tie.name for ties in verdict.ties for tie in ties}
    return set(verdict.confirmed) | set(verdict.ambiguous) | ties


def iiwa_model(folder, q, tau, seed, **choice):
    noise = NOISE * np.random.default_rng([seed, 1]).standard_normal(q.shape)
    log = write_rests(folder, IIWA, IIWA_JOINTS, q, tau + noise)
    model = model_of([log], ModelChoice(**choice))
    assert check_data([log], model) == ()
    return model


def _offset(q):
    return "TorqueOffset", ELBOW, 0.6 + 0 * q[:, ELBOW]


def _spring(q):
    return "JointSpring", SHOULDER, 2.0 * q[:, SHOULDER]


def _gain(q):
    return "TorqueGain", ELBOW, 0.1 * iiwa_weight(q)[:, ELBOW]


def _friction(q):
    return "JointCoulombFriction", SHOULDER, 0.6 * arrivals(q)[:, SHOULDER]


@pytest.mark.slow
@pytest.mark.parametrize("hidden", [_offset, _spring, _gain, _friction])
def test_the_iiwa_at_rest_names_what_is_at_a_joint(hidden, tmp_path):
    q = iiwa_poses(40, seed=3)
    kind, joint, added = hidden(q)
    tau = iiwa_weight(q)
    tau[:, joint] += added
    verdict = close_loop(iiwa_model(tmp_path / "log", q, tau, seed=3)).verdict
    assert f"{kind}.{IIWA_JOINTS[joint]}" in named(verdict)
    assert len(verdict.names) == 1


@pytest.mark.slow
def test_the_iiwa_at_rest_names_a_tilted_base(tmp_path):
    rx, ry, q = 0.03, -0.02, iiwa_poses(40, seed=4)
    tau = iiwa_weight(q, GRAVITY * np.array([ry, -rx, -1.0]))
    found = close_loop(iiwa_model(tmp_path / "log", q, tau, seed=4))
    assert found.verdict.confirmed == ("ArmTilt",)
    (tilt,) = found.last.model.effects_at(found.last.theta)
    assert (tilt.rx, tilt.ry) == pytest.approx((rx, ry), abs=3e-3)


@pytest.mark.slow
def test_the_iiwa_at_rest_names_a_payload_beside_the_masses_of_the_urdf(tmp_path):
    mass, moment = 1.0, [0.02, -0.03, 0.1]
    q = iiwa_poses(40, seed=5)
    tau = iiwa_weight(q, mass=mass, first_moment=moment)
    only = (ParameterRequest("iiwa_link_2.mx"),)
    found = close_loop(iiwa_model(tmp_path / "log", q, tau, seed=5, requests=only))
    assert found.verdict.confirmed == ("FlangePayload",)
    (payload,) = found.last.model.effects_at(found.last.theta)
    assert payload.mass == pytest.approx(mass, abs=0.02)
    np.testing.assert_allclose(payload.first_moment, moment, atol=0.01)


@pytest.mark.slow
def test_a_payload_in_one_of_two_logs_is_what_they_differ_by(tmp_path):
    logs = []
    for seed, mass in ((6, 0.0), (7, 1.0)):
        q = iiwa_poses(30, seed)
        tau = iiwa_weight(q, mass=mass, first_moment=[0.0, 0.0, 0.1 * mass])
        tau += NOISE * np.random.default_rng([seed, 1]).standard_normal(q.shape)
        logs.append(write_rests(tmp_path / f"{seed}", IIWA, IIWA_JOINTS, q, tau))
    verdict = close_loop(model_of(logs, ModelChoice())).verdict
    (against,) = verdict.contradictions
    assert against.effect == "FlangePayload" and not verdict.confirmed


@pytest.fixture
def small_arm(tmp_path):
    """A log of two joints, its noise alone; more torques may be added to it."""
    urdf = write_two_link_arm(tmp_path / "two.urdf")
    random = np.random.default_rng(0)
    q = from_both_sides(random.uniform(-1.5, 1.5, (40, 2)), random)
    zero = write_rests(tmp_path / "zero", urdf, JOINTS, q, np.cos(q))
    model = model_of([zero], ModelChoice())
    weight = model.predictions(np.array([p.nominal for p in model.parameters]))
    noise = 0.03 * random.standard_normal(q.shape)

    def log(name, added=0.0, time=None):
        return write_rests(
            tmp_path / name, urdf, JOINTS, q, weight + noise + added, time
        )

    return q, log


def test_nothing_is_named_where_nothing_is_hidden(small_arm):
    _, log = small_arm
    only = model_of([log("log")], ModelChoice())
    verdict = close_loop(only).verdict
    assert verdict.ending == "none" and not verdict.names
    assert set(verdict.undetectable) >= OF_MOTION


def test_dry_friction_at_all_joints_is_named_with_its_size(small_arm):
    q, log = small_arm
    model = model_of([log("log", 0.3 * arrivals(q))], ModelChoice())
    verdict = close_loop(model).verdict
    assert verdict.confirmed == tuple(f"JointCoulombFriction.{j}" for j in JOINTS)
    sizes = [v for v in verdict.values if v.name.endswith(".size")]
    assert [v.value for v in sizes] == pytest.approx([0.3, 0.3], abs=0.03)


def test_from_one_side_friction_is_an_offset_as_well(tmp_path):
    urdf = write_two_link_arm(tmp_path / "two.urdf")
    random = np.random.default_rng(1)
    q = np.column_stack([np.linspace(-1.5, 1.5, 80), random.uniform(-1.5, 1.5, 80)])
    bare = write_rests(tmp_path / "bare", urdf, JOINTS, q, np.cos(q))
    model = model_of([bare], ModelChoice())
    tau = model.predictions(np.array([p.nominal for p in model.parameters]))
    tau[:, 0] += 0.3 * arrivals(q)[:, 0]
    tau += 0.03 * random.standard_normal(q.shape)
    log = write_rests(tmp_path / "log", urdf, JOINTS, q, tau)
    found = close_loop(model_of([log], ModelChoice()))
    either = {
        f"{kind}.{JOINTS[0]}" for kind in ("JointCoulombFriction", "TorqueOffset")
    }
    assert either <= named(found.verdict) and not found.verdict.confirmed
    assert "reached from both sides" in found.text


def test_rests_that_are_far_apart_in_time_are_no_jumps(small_arm):
    q, log = small_arm
    time = np.cumsum(np.random.default_rng(1).uniform(1.0, 60.0, len(q)))
    read = log("log", time=time)
    assert check_data([read], model_of([read], ModelChoice())) == ()
