import dataclasses

import numpy as np
import pytest
from pydrake.math import RigidTransform, RollPitchYaw

from drake_disasm.common.rotations import Pose
from drake_disasm.common.spatial import rotation_from_vector
from drake_disasm.parts import ImpactConfig
from drake_disasm.scenario import load_scenario, validate
from drake_disasm.systems.observation import Mounting, contact_wrench
from sysid.identification.gauss_newton import gauss_newton
from sysid.models import PredictionError
from sysid.models.sensor_reading import at_bolt, at_sensor
from sysid.models.twin import TwinModel
from sysid.objective import Objective
from sysid.scenario_parameters import ParameterRequest, scenario_parameters
from sysid.workers import Workers
from tests.refusals import refused

NAMES = ("contact.friction", "part.clearance", "GroovePose.ry")


def make(log, scenario, names=NAMES, **options) -> TwinModel:
    scenario, parameters = scenario_parameters(
        scenario, [ParameterRequest(n) for n in names]
    )
    return TwinModel([log], scenario, parameters, **options)


def truth(model: TwinModel) -> np.ndarray:
    return np.array([p.nominal for p in model.parameters])


def test_reproduces_the_twins_own_log(silent_log, turned):
    """Each step from its measured state: the pose to 8 um, forces to noise / 4.

    What is left is the arm's velocity at the step's start, which no log has: a contact
    was made in the step before, nobody knows when.
    """
    model = make(silent_log, turned)
    residual = Objective(model, Workers()).residuals(truth(model))[0]
    assert np.abs(residual[:, :6]).max() < 0.4
    assert np.quantile(np.abs(residual[:, 6:]), 0.95) < 0.25


def test_a_rollout_reproduces_a_whole_episode(silent_log, turned):
    model = make(silent_log, turned, rollout=True)
    assert [s.stop - s.start for s in model.chunks()] == [24, 24]
    residual = Objective(model, Workers()).residuals(truth(model))[0]
    assert np.abs(residual[:, :6]).max() < 0.5
    assert np.quantile(np.abs(residual[:, 6:]), 0.95) < 0.25


def test_at_the_truth_the_objective_is_the_sensors_noise(log, turned):
    """Wrench channels at 1, pose channels (which a twin's log has exactly) at 0."""
    objective = Objective(make(log, turned), Workers())
    residual = objective.residuals(truth(objective.model))[0]
    assert np.sqrt(np.mean(residual[:, 6:] ** 2)) == pytest.approx(1.0, abs=0.1)
    assert objective(truth(objective.model))[0] == pytest.approx(0.707, abs=0.07)


@pytest.mark.slow
def test_workers_and_chunks_do_not_change_a_bit(log, turned, monkeypatch):
    model = make(log, turned)
    thetas = np.array([truth(model), [0.3, 5e-4, 0.02]])
    alone = Objective(model, Workers()).residuals(thetas)
    with Workers(2) as pool:
        shared = Objective(model, pool).residuals(thetas)
    monkeypatch.setattr("sysid.models.twin._CHUNK", 7)
    cut = Objective(model, Workers()).residuals(thetas)
    for a, b, c in zip(alone, shared, cut, strict=True):
        assert a.tobytes() == b.tobytes() == c.tobytes()


def test_a_thinned_log_keeps_rows_that_follow_each_other(log, turned):
    thin = make(log, turned).thin(2)
    rows = thin._transitions.rows
    runs = np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)
    assert {len(run) for run in runs} == {6}
    assert len(rows) == thin.measurements.rows == 36


@pytest.mark.slow
def test_recovers_parameters_from_nearby(log, turned):
    start = dataclasses.replace(turned, effects=[])
    model = make(log, start, ["contact.friction", "GroovePose.ry"])
    objective = Objective(model.thin(4), Workers())
    begin = objective.scaling.to_unit(np.array([0.25, 0.033]))
    found = objective.scaling.from_unit(gauss_newton(objective, begin, 5).u)
    np.testing.assert_allclose(found, [0.2, 0.0349], rtol=0.03)


def test_with_impact_too_chunks_do_not_change_a_bit(impact_log, impact, monkeypatch):
    model = make(impact_log, impact)
    whole = Objective(model, Workers()).residuals(truth(model))[0]
    monkeypatch.setattr("sysid.models.twin._IMPACT_CHUNK", 7)
    assert len(model.chunks()) == 7
    cut = Objective(model, Workers()).residuals(truth(model))[0]
    assert whole.tobytes() == cut.tobytes()


def test_a_rollout_with_impact_is_the_diagrams(impact_log, impact):
    model = make(impact_log, impact, rollout=True).of_episodes([0])
    residual = Objective(model, Workers()).residuals(truth(model))[0]
    assert np.sqrt(np.mean(residual[:, 6:] ** 2)) == pytest.approx(1.0, abs=0.15)


def test_channels_are_weighted_by_the_sensors_noise(log, turned):
    channels = make(log, turned).measurements.channels
    assert [c.name for c in channels[6:9]] == ["fx", "fy", "fz"]
    np.testing.assert_allclose(
        [c.noise for c in channels[6:]], turned.ft_sensor.noise, rtol=1e-3
    )
    assert channels[0].unit == "m" and channels[0].noise == 2e-5


def test_a_scenario_that_cannot_be_is_a_failed_prediction(log, turned):
    model = make(log, turned, ["part.neck_diameter"])
    with pytest.raises(PredictionError, match="slips through"):
        model.predict(np.array([0.011]), slice(0, 2))
    assert model.predict(np.array([0.005]), slice(0, 2)).shape == (2, 12)


def test_episodes_rows_and_frozen_parameters(log, turned):
    model = make(log, turned)
    part = model.of_episodes([0, 2])
    assert part.measurements.names == ("log/episode_0000", "log/episode_0002")
    assert set(part.measurements.episode) == {0, 1} and part.measurements.rows == 48
    assert model.thin(8).measurements.rows == 12
    frozen = model.freeze({"GroovePose.ry": 0.01})
    assert [p.name for p in frozen.parameters] == list(NAMES[:2])
    assert frozen.scenario.effects[0].ry == 0.01 and model.scenario.effects[0].ry > 0.03


def test_refuses_other_logs(log, turned):
    with refused("task.period"):
        make(log, load_scenario("removal", ["task.period=0.2"]))
    header = dataclasses.replace(log.header, kind="static_wrench")
    with refused("static_wrench", "'transitions'"):
        make(dataclasses.replace(log, header=header), turned)


X_SOMEWHERE = RigidTransform(RollPitchYaw(0.3, -0.2, 0.9), [0.01, 0.02, 0.21])


@pytest.mark.parametrize("X_GS", [None, X_SOMEWHERE], ids=["wrist", "part"])
def test_the_load_on_the_sensor_is_the_inverse_of_processing(X_GS):
    g_W = np.array([0.0, 0.0, -9.81])
    mounting = Mounting(X_SOMEWHERE, np.eye(3), 1.5, np.ones(3), g_W, X_GS)
    load, turn = np.array([1.0, -2.0, 3.0, 0.1, 0.2, -0.3]), np.array([0.1, -0.05, 0.2])
    X_GB = RigidTransform(rotation_from_vector(turn), [1e-3, 2e-3, 3e-3])
    R_GS = mounting.from_bolt(Pose.of(X_GB)).R
    offset = 0.1 * np.arange(6)
    reading = load + offset + mounting.weight(R_GS)
    wrench = contact_wrench(reading, offset, Pose.of(X_GB), mounting)
    state = np.concatenate([X_GB.translation(), turn, wrench])[None]
    found = at_sensor(state, mounting)
    np.testing.assert_allclose(found[0, 6:], load, atol=1e-12)
    np.testing.assert_array_equal(found[:, :6], state[:, :6])
    np.testing.assert_allclose(at_bolt(found, mounting), state, atol=1e-12)


def test_a_surrogate_is_as_stiff_as_the_head(log, turned):
    model = make(log, turned)
    theta = np.array([p.nominal for p in model.parameters])
    wanted, stiff = model.predictions(theta), model.surrogate()
    contact = dataclasses.replace(stiff.scenario.contact, impact=ImpactConfig())
    other = stiff.replace(scenario=dataclasses.replace(stiff.scenario, contact=contact))
    errors = [
        np.sqrt(np.mean(((m.predictions(theta) - wanted) / m.measurements.sigma) ** 2))
        for m in (stiff, other)
    ]
    assert errors[0] < errors[1]


def test_a_surrogate_has_impact_unless_a_parameter_means_nothing_to_it(log, turned):
    model = make(log, turned)
    surrogate = model.surrogate()
    assert surrogate.scenario.contact.model == "impact" and not surrogate.costly
    assert model.scenario.contact.model == "hydroelastic" and model.costly
    assert surrogate.surrogate() is surrogate
    own = make(log, turned, ["contact.modulus"])
    assert own.surrogate() is own
    hard = make(log, load_scenario("removal", ["contact.head_modulus=1e11"]))
    validate(hard.surrogate().scenario)
    assert hard.surrogate().scenario.contact.impact.exponent == 1.0
