import numpy as np
import pytest
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import MultibodyForces

from drake_disasm.effects import (
    JointAsymmetricFriction,
    JointBacklash,
    JointElasticity,
    JointViscousFriction,
    TorqueRipple,
)
from drake_disasm.logs import read_log
from drake_disasm.scenario import Scenario
from sysid.fitting.candidates import Candidate, extended
from sysid.identification import SearchSettings, Settings, identify
from sysid.models.from_logs import ModelChoice, model_of
from sysid.models.joint_motion import JointMotionModel
from sysid.models.regressor import ArmRegressor, base_set, body_regressor
from tests.refusals import refused
from tests.sysid.models.arm import JOINTS, write_motion_log, write_two_link_arm
from tests.sysid.real_data import write_arm, write_motion


@pytest.fixture
def urdf(tmp_path):
    return write_two_link_arm(tmp_path / "two.urdf")


def states(n, seed=0):
    return np.random.default_rng(seed).uniform(-2.0, 2.0, (3, n, 2))


def drakes_torques(urdf, q, v, vd):
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModels(str(urdf))
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("base"))
    plant.Finalize()
    context, torques = plant.CreateDefaultContext(), []
    for state in zip(q, v, vd, strict=True):
        plant.SetPositions(context, state[0])
        plant.SetVelocities(context, state[1])
        forces = MultibodyForces(plant)
        plant.CalcForceElementsContribution(context, forces)
        torques.append(plant.CalcInverseDynamics(context, state[2], forces))
    return np.array(torques)


def motion_log(folder, urdf, noise=0.0, n=300, drop=()):
    q, v, vd = states(n)
    tau = drakes_torques(urdf, q, v, vd)
    tau += noise * np.random.default_rng(1).normal(size=tau.shape)
    columns = {"time": 0.01 * np.arange(n), "q": q, "v": v, "vd": vd, "tau": tau}
    columns = {k: x for k, x in columns.items() if k not in drop}
    return write_motion_log(folder, urdf, columns)


def test_the_regressor_is_drakes_inverse_dynamics(urdf):
    arm = ArmRegressor(str(urdf), JOINTS)
    q, v, vd = states(30)
    tau = arm.regressor(q, v, vd) @ arm.inertia
    np.testing.assert_allclose(tau, drakes_torques(urdf, q, v, vd), atol=1e-12)


def test_the_order_of_joints_is_the_logs(urdf):
    q, v, vd = states(5)
    forth = ArmRegressor(str(urdf), JOINTS).regressor(q, v, vd)
    back = ArmRegressor(str(urdf), JOINTS[::-1])
    swapped = back.regressor(q[:, ::-1], v[:, ::-1], vd[:, ::-1])
    np.testing.assert_allclose(swapped[:, ::-1], forth)


def test_a_point_mass_at_rest_weighs_what_it_weighs():
    """m = 2, 0.5 m along x, at rest, gravity 9.81 along -z: f = 2 (0, 0, 9.81)."""
    Y = body_regressor(np.zeros(3), np.zeros(3), np.array([0, 0, 9.81]))
    pi = np.array([2.0, 1.0, 0, 0, 0, 0, 0, 0.5, 0, 0.5])
    np.testing.assert_allclose(Y @ pi, [0, -9.81, 0, 0, 0, 19.62])


def test_the_base_set_predicts_all_that_the_full_one_does(urdf):
    arm = ArmRegressor(str(urdf), JOINTS)
    base = base_set(arm.random_regressor())
    assert len(base.independent) < 20 and len(base.independent) >= 9
    q, v, vd = states(20, seed=5)
    Y = arm.regressor(q, v, vd)
    np.testing.assert_allclose(
        Y[:, :, base.independent] @ base.beta(arm.inertia), Y @ arm.inertia, atol=1e-9
    )
    flat = Y[:, :, base.independent].reshape(40, -1)
    assert np.linalg.matrix_rank(flat) == len(base.independent)
    assert base.label(0, arm.names).split()[0] == arm.names[base.independent[0]]


def test_recovers_the_base_parameters(urdf, tmp_path):
    model = JointMotionModel([motion_log(tmp_path / "log", urdf, noise=0.01)])
    settings = Settings(
        search=SearchSettings(evaluations=60, local_evaluations=10), huber_delta=np.inf
    )
    found = identify(model, settings=settings)
    truth = np.array([p.nominal for p in model.parameters])
    inside = (found.interval_gauss_newton[:, 0] < truth) & (
        truth < found.interval_gauss_newton[:, 1]
    )
    assert inside.mean() > 0.7
    np.testing.assert_allclose(found.theta, truth, atol=0.02)
    np.testing.assert_allclose([c.noise for c in found.channels], 0.01, rtol=0.2)
    assert found.agreement.agree


def test_some_parameters_alone(urdf, tmp_path):
    model = JointMotionModel([motion_log(tmp_path / "log", urdf)])
    name = model.parameters[2].name
    alone = model.only([name])
    assert [p.name for p in alone.parameters] == [name]
    theta = np.array([model.parameters[2].nominal])
    np.testing.assert_allclose(
        alone.predictions(theta), model.measurements.values, atol=1e-9
    )
    with refused("not a base parameter"):
        model.only(["upper.mass"])


def test_refuses_an_arm_that_is_not_there_or_another(urdf, tmp_path):
    log = motion_log(tmp_path / "log", urdf)
    with refused("missing"):
        JointMotionModel([log], str(tmp_path / "none.urdf"))
    with refused("'vd.*'"):
        JointMotionModel([motion_log(tmp_path / "less", urdf, drop=("vd",))])
    scenario = Scenario(effects=[JointViscousFriction("elbwo", 0.7)])
    with refused("did you mean 'elbow'"):
        model_of([log], ModelChoice(urdf=str(urdf), scenario=scenario))
    other = tmp_path / "other.urdf"
    other.write_text(urdf.read_text().replace("elbow", "elbo"))
    with refused("did you mean 'elbo'"):
        JointMotionModel([log], str(other))


@pytest.mark.slow
def test_a_real_arm_has_43_base_parameters(tmp_path):
    """43 of 80; a free fit leaves 6.6 % on its own recording, 6.3 % on the other."""
    arm = write_arm(tmp_path / "lwr4.urdf")
    logs = [read_log(write_motion(i, tmp_path / f"r{i}", arm)) for i in (1, 2)]
    model = JointMotionModel(logs)
    assert len(model.parameters) == 43
    Y, tau = model._motion.Y.reshape(-1, 43), model.measurements.values.reshape(-1)
    half = len(tau) // 2
    beta = np.linalg.lstsq(Y[:half], tau[:half], rcond=None)[0]
    for rows, expected in ((slice(0, half), 0.0658), (slice(half, None), 0.0626)):
        error = np.linalg.norm(Y[rows] @ beta - tau[rows]) / np.linalg.norm(tau[rows])
        assert error == pytest.approx(expected, abs=2e-4)


def test_a_scenarios_own_effects_at_joints_act(urdf, tmp_path):
    motion_log(tmp_path / "log", urdf)
    logs = [read_log(tmp_path / "log")]
    bare, rubbing = (
        model_of(logs, ModelChoice(urdf=str(urdf), scenario=Scenario(effects=effects)))
        for effects in ([], [JointViscousFriction("elbow", 0.7)])
    )
    theta = np.array([p.nominal for p in bare.parameters])
    more = rubbing.predictions(theta) - bare.predictions(theta)
    v = states(300)[1]
    np.testing.assert_allclose(more, np.column_stack([0 * v[:, 0], 0.7 * v[:, 1]]))


def test_a_ripple_shows_in_a_motion_over_a_whole_period(urdf, tmp_path):
    model = JointMotionModel([motion_log(tmp_path / "log", urdf)])
    assert model.travel == pytest.approx(dict.fromkeys(JOINTS, 4.0), abs=0.1)
    ripples = model.applicable_effects([TorqueRipple])
    assert {effect.periods for effect in ripples} == {2.0, 4.0, 8.0}
    [_, _, periods] = extended(model, [Candidate.of(ripples[0])], with_shapes=True)[
        0
    ].parameters[-3:]
    assert periods.low == pytest.approx(2.0 * np.pi / model.travel[JOINTS[0]])
    short = model.of_rows(np.abs(states(300)[0]).max(axis=1) < 0.7)
    assert {e.periods for e in short.applicable_effects([TorqueRipple])} == {8.0}


def test_one_stroke_shows_no_friction_that_depends_on_the_direction(urdf, tmp_path):
    model = JointMotionModel([motion_log(tmp_path / "log", urdf)])
    assert len(model.applicable_effects([JointAsymmetricFriction])) >= 2
    forth = model.of_rows(states(300)[1][:, 0] > 0.0)
    assert forth.one_way == (JOINTS[0],)
    found = forth.applicable_effects([JointAsymmetricFriction])
    assert {effect.joint for effect in found} == {JOINTS[1]}


def test_play_is_no_candidate_where_torques_can_not_show_it(urdf, tmp_path):
    model = JointMotionModel([motion_log(tmp_path / "log", urdf)])
    found = model.applicable_effects([JointBacklash, JointElasticity])
    assert {type(e) for e in found} == {JointElasticity}
