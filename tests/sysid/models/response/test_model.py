import dataclasses
import math

import numpy as np
import pytest

from drake_disasm.effects import (
    JointBacklash,
    JointCoulombFriction,
    JointElasticity,
    JointLoadFriction,
    JointQuadraticFriction,
    TorqueGain,
    registered_effects,
)
from drake_disasm.logs import LogWriter, flat_columns, read_log
from sysid.data_checks.check import check_data
from sysid.effect_selection.close_loop import close_loop
from sysid.effect_selection.linear_system import linear_system
from sysid.fitting.candidates import candidates, extended
from sysid.fitting.fitter import Fitter
from sysid.fitting.settings import DEFAULT_SETTINGS
from sysid.identification.gauss_newton import gauss_newton
from sysid.models.from_logs import ModelChoice, model_of
from sysid.models.response.model import JointResponseModel, _assumption
from sysid.models.response.segments import measured_noise
from sysid.objective import Objective
from sysid.workers import Workers
from tests.refusals import refused
from tests.sysid.models.response.servo import (
    DAMPING,
    DELAY,
    QUANTUM,
    STIFFNESS,
    goals,
    write_response,
)


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    return write_response(tmp_path_factory.mktemp("servo") / "log", duration=3.0)


def true_parameters():
    return np.array([STIFFNESS, DAMPING, DELAY])


def test_with_the_true_parameters_the_residual_is_the_encoders(log):
    model = model_of([log], ModelChoice())
    assert model.measurements.noise == pytest.approx(QUANTUM / math.sqrt(12), rel=0.3)
    error = model.predictions(true_parameters()) - model.measurements.values
    assert np.sqrt(np.mean(error**2)) < 0.4 * QUANTUM


def test_a_fit_finds_the_drive(log):
    objective = Objective(JointResponseModel([log]))
    found = gauss_newton(objective, objective.start, 12)
    theta = objective.scaling.from_unit(found.u)
    np.testing.assert_allclose(theta, true_parameters(), rtol=0.05)


def test_a_fit_begins_near_the_drive_and_its_delay(log):
    model = JointResponseModel([log])
    assert model.default_huber_delta == math.inf  # far off in every row: no outliers
    assert not model.assumptions
    nominal = {p.name: p.nominal for p in model.parameters}
    assert nominal["delay"] == pytest.approx(DELAY, abs=0.0026)
    assert nominal["servo.stiffness"] == pytest.approx(STIFFNESS, rel=0.2)


def test_a_whole_episode_is_one_segment_if_asked(log):
    model = JointResponseModel([log], segment=math.inf)
    error = model.predictions(true_parameters()) - model.measurements.values
    assert np.abs(error).max() < 0.01


def test_selected_rows_are_predicted_as_among_all(log):
    model = JointResponseModel([log])
    mask = np.random.default_rng(0).random(model.measurements.rows) < 0.3
    some = model.of_rows(mask).predictions(true_parameters())
    whole = model.predictions(true_parameters())
    np.testing.assert_allclose(some, whole[mask], atol=1e-12)


def test_covariates_are_the_joints_own_motion(log):
    whole = JointResponseModel([log])
    model = whole.of_rows(whole.measurements.episode == 1)
    found = model.covariates(0)
    assert set(found) == {"time", "position", "velocity", "distance to the goal"}
    time, position = found["time"], found["position"]
    speed = np.gradient(position, time)
    assert np.corrcoef(found["velocity"], speed)[0, 1] > 0.99
    goal = log.episodes[1]["q_commanded"][:, 0]
    np.testing.assert_allclose(found["distance to the goal"] + position, goal)


def test_what_is_in_a_torque_sensor_alone_is_no_candidate(log):
    model = JointResponseModel([log])
    kinds = {type(e) for e in model.applicable_effects(registered_effects())}
    assert JointCoulombFriction in kinds
    assert TorqueGain not in kinds


def rewritten(log, folder, header=None, **columns):
    """Returns a log with other columns or another header."""
    episode = log.episodes[0]
    table = {name: episode[name] for name in ("time", "q_commanded", "q")} | columns
    with LogWriter(folder, header or log.header) as writer:
        writer.write_episode(flat_columns("joint_response", table))
    return read_log(folder)


@pytest.mark.parametrize("gap", [0.0, 0.3])
def test_uneven_times_are_no_finding_but_gaps_are(log, tmp_path, gap):
    steps = np.random.default_rng(0).choice([0.0035, 0.0055], 800)
    time = np.cumsum(steps) + np.where(np.arange(800) > 400, gap, 0.0)
    table = {"q_commanded": goals(time, 0), "q": 0.8 * goals(time - 0.03, 0)}
    uneven = rewritten(log, tmp_path / "uneven", time=time, **table)
    kinds = [f.kind for f in check_data([uneven], JointResponseModel([uneven]))]
    assert ("time" in kinds) == (gap > 0.0)


def test_degrees_and_a_wrong_sign_are_found(log, tmp_path):
    q = log.episodes[0]["q"]
    degrees = rewritten(log, tmp_path / "degrees", q=np.rad2deg(q))
    findings = check_data([degrees], JointResponseModel([degrees]))
    assert any("57" in f.what or "degrees" in f.what for f in findings)
    goal = log.episodes[0]["q_commanded"]
    near = rewritten(log, tmp_path / "near", q=goal + 0.01 * (goal - q))
    with refused("says nothing of stiffness"):
        JointResponseModel([near])
    mirrored = rewritten(log, tmp_path / "mirrored", q=-q)
    with refused("does not follow"):
        JointResponseModel([mirrored])


@pytest.mark.parametrize(
    ("drive", "why"),
    [
        ({"limits": 1.0}, "'drive.limits'"),
        ({"limit": True}, "number above zero"),
        ({"gravity_compensation": "yes"}, "true or false"),
    ],
)
def test_a_drive_that_can_not_be_is_refused(log, tmp_path, drive, why):
    header = dataclasses.replace(log.header, drive=drive)
    other = rewritten(log, tmp_path / "other", header)
    with refused(why):
        JointResponseModel([other])


def test_an_arm_whose_urdf_is_gone_is_one_line_with_the_remedy(log, tmp_path):
    header = dataclasses.replace(log.header, urdf=str(tmp_path / "gone.urdf"))
    other = rewritten(log, tmp_path / "other", header)
    with refused("gone.urdf", "`urdf`", "log.yaml"):
        JointResponseModel([other])
    model = JointResponseModel([other], urdf=log.header.urdf)
    assert model.joints == log.header.joints


def test_no_candidate_fails_where_its_derivative_is_taken(log):
    model = JointResponseModel([log])
    fitter = Fitter.of(model, Workers(), model.default_huber_delta, DEFAULT_SETTINGS)
    fit = fitter.fit(())
    found = linear_system(fitter, fit, candidates(model))
    size = np.abs(found.linearisation.jacobian).max()
    # A failure counts as a million times the noise, over a step of a ten-thousandth.
    assert size < 1e8


@pytest.mark.slow
@pytest.mark.parametrize(
    "hidden",
    [
        JointLoadFriction("servo", 0.4, 0.02),
        JointElasticity("servo", 0.05),
        JointBacklash("servo", 0.02, 0.02),
    ],
    ids=lambda e: type(e).__name__,
)
def test_the_loop_names_what_is_hidden_in_a_servo(tmp_path, hidden):
    log = write_response(tmp_path / "log", hidden)
    closed = close_loop(JointResponseModel([log]))
    assert closed.verdict.names[0].startswith(type(hidden).__name__)


def test_friction_per_squared_load_is_at_most_what_locks_the_gear(log):
    """Beyond it there is no derivative: nothing moves."""
    model = JointResponseModel([log])
    model, _ = extended(model, candidates(model, [JointQuadraticFriction]))
    (high,) = [p.high for p in model.parameters if p.unit == "1/(N m)"]
    heaviest = 0.5 * 9.81 * 0.1  # N m, of the pendulum held out straight
    assert 0.3 / heaviest < high < 3.0 / heaviest


@pytest.mark.parametrize(("rate", "noise"), [(50.0, 1e-3), (500.0, 3e-5)])
def test_the_noise_is_told_from_the_motion_at_any_rate(rate, noise):
    """Of rows that are not evenly spaced, of a joint that reverses twice a second."""
    random = np.random.default_rng(0)
    time = np.arange(0.0, 20.0, 1.0 / rate)
    time = time + random.uniform(0.0, 0.1 / rate, len(time))
    q = 0.3 * np.sin(np.pi * time) + 0.05 * np.sin(4.0 * np.pi * time)
    q = q[:, None] + random.normal(0.0, noise, (len(time), 1))
    assert measured_noise([{"time": time, "q": q}]) == pytest.approx(noise, rel=0.2)


def test_an_arm_without_encoder_noise_has_what_steps_of_time_leave():
    time = np.arange(0.0, 20.0, 0.005)
    q = np.stack([0.5 * np.sin(time), np.full(len(time), 0.3)], axis=1)
    least = [1e-5, 1e-6]  # of a radian of travel, and of none
    assert measured_noise([{"time": time, "q": q}]) == pytest.approx(least, rel=0.01)


@pytest.fixture(scope="module")
def held(tmp_path_factory):
    """A servo whose controller holds the pendulum, which its log does not say."""
    folder = tmp_path_factory.mktemp("held") / "log"
    return write_response(folder, duration=3.0, compensates=True, quantum=1e-5)


def test_a_controller_that_holds_the_arm_is_known_by_the_motion(held):
    model = JointResponseModel([held])
    error = model.predictions(true_parameters()) - model.measurements.values
    assert np.sqrt(np.mean(error**2)) < 3e-4
    (found,) = [f for f in check_data([held], model) if f.kind == "assumed"]
    assert "gravity_compensation: true" in found.remedy


def _stating(log, compensates):
    header = dataclasses.replace(
        log.header, drive={"gravity_compensation": compensates}
    )
    return dataclasses.replace(log, header=header)


def test_what_is_stated_counts_and_is_doubted(held):
    (assumed,) = JointResponseModel([_stating(held, False)]).assumptions
    assert "otherwise" in assumed.what
    said = _assumption(True, False, (0.01, 0.8)).what
    assert "otherwise" in said and "80 %" in said and "1 %" in said


def test_where_what_is_stated_can_not_be_the_refusal_says_so(log):
    with refused("gravity_compensation: false"):
        JointResponseModel([_stating(log, True)])
