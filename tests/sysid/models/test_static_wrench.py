import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from drake_disasm.cell.tool import Tool
from drake_disasm.logs import read_log, write_static_wrench
from drake_disasm.scenario import Scenario, load_scenario
from sysid.identification import SearchSettings, Settings, identify
from sysid.identification.noise import with_estimated_noise
from sysid.models.from_logs import ModelChoice, model_of
from sysid.models.static_wrench import DEFAULT_PARAMETERS, StaticWrenchModel
from sysid.scenario_parameters import ParameterRequest, scenario_parameters
from sysid.workers import Workers
from tests.refusals import refused
from tests.sysid.real_data import write_static

TRUTH = np.array([1.1, 0.01, -0.02, 0.06, 1.0, -2.0, 3.0, 0.1, 0.2, -0.3])
SETTINGS = Settings(
    search=SearchSettings(evaluations=60, local_evaluations=10), huber_delta=np.inf
)
EQUAL = ("PayloadError.mass", "PayloadError.cz", *DEFAULT_PARAMETERS[4:])


def synthetic(folder, noise=0.0, poses=20, payload=(0.0, (0.0, 0.0, 0.0))):
    R = Rotation.random(poses, random_state=1)
    g_S = R.inv().apply([0.0, 0.0, -9.81])
    m, c = TRUTH[0] + payload[0], TRUTH[1:4] + payload[0] * np.array(payload[1])
    reading = np.hstack([m * g_S, np.cross(c, g_S)]) + TRUTH[4:]
    reading += noise * np.random.default_rng(0).normal(size=reading.shape)
    quaternions = R.as_quat()[:, [3, 0, 1, 2]]
    write_static_wrench(folder, quaternions, reading, "S", "weigh", {})
    return read_log(folder)


def make(log, names=DEFAULT_PARAMETERS, scenario=None, known=False):
    requests = [ParameterRequest(n) for n in names]
    scenario, parameters = scenario_parameters(scenario or Scenario(), requests)
    return StaticWrenchModel([log], scenario, parameters, known)


def fit(model):
    return identify(model, train=[0], settings=SETTINGS)


def test_predicts_weight_moment_and_bias_in_closed_form(tmp_path):
    log = synthetic(tmp_path / "log")
    model = make(log)
    predicted = model.predict(TRUTH, slice(0, 20))
    np.testing.assert_allclose(predicted, log.episodes[0]["wrench"], atol=2e-3)


def test_recovers_ten_parameters(tmp_path):
    found = fit(make(synthetic(tmp_path / "log", noise=0.01)))
    np.testing.assert_allclose(found.theta, TRUTH, atol=0.02)
    assert found.agreement.agree
    weight, unit, (low, high) = found.derived["weight"]
    assert unit == "N" and low < weight < high
    assert weight == pytest.approx(1.1 * 9.81, rel=2e-3)
    assert found.derived["centre of mass z"][0] == pytest.approx(0.06 / 1.1, rel=0.02)


def test_a_known_payload_is_taken_off(tmp_path):
    scenario = load_scenario("removal")
    tool = Tool.from_models(scenario)
    log = synthetic(tmp_path / "log", payload=(tool.mass, tool.p_SoScm_S))
    model = make(log, scenario=scenario, known=True)
    predicted = model.predict(TRUTH, slice(0, 20))
    np.testing.assert_allclose(predicted, log.episodes[0]["wrench"], atol=3e-3)


def test_unknown_noise_is_one_for_forces_and_one_for_torques(tmp_path):
    model = with_estimated_noise(
        make(synthetic(tmp_path / "log", noise=0.01, poses=200)), Workers(), np.inf
    )
    noise = model.measurements.noise
    assert len(set(noise[:3])) == len(set(noise[3:])) == 1
    np.testing.assert_allclose(noise, 0.01, rtol=0.1)


def test_only_sensor_effects_reach_a_reading_at_rest(tmp_path):
    log = synthetic(tmp_path / "log")
    with refused("contact.friction", "static readings"):
        make(log, ["contact.friction"])
    with refused("`objective` rollout"):
        model_of([log], ModelChoice(objective="rollout"))
    with refused("`noise` fq", "no such channel"):
        model_of([log], ModelChoice(noise=(("fq", 1.0),)))
    stated = model_of([log], ModelChoice(noise=(("fx", 0.5),)))
    assert stated.measurements.channels[0].noise == 0.5


def test_the_published_values_of_seven_real_readings(tmp_path):
    """Authors: 10.80391 N, bias (-2.13583, -2.76399, -13.07675) N, lever 0.05197 m,

    torque bias (-0.15658, -0.07939, 0.12979) N m; their model has the centre of
    mass on the sensor's axis.
    """
    found = fit(make(read_log(write_static(7, tmp_path / "log")), EQUAL))
    assert found.derived["weight"][0] == pytest.approx(10.80391, abs=1e-5)
    np.testing.assert_allclose(
        found.theta[2:5], [-2.13583, -2.76399, -13.07675], atol=1e-5
    )
    assert found.derived["centre of mass z"][0] == pytest.approx(0.05197, abs=1e-5)
    np.testing.assert_allclose(
        found.theta[5:], [-0.15658, -0.07939, 0.12979], atol=1e-5
    )
