"""What the simulator does with an effect, the model of a log says, too."""

import copy
import dataclasses

import numpy as np
import pytest

from drake_disasm.effects import (
    Backlash,
    BoltSlip,
    ChainPull,
    Compliance,
    GrooveBend,
    GrooveClearance,
    GrooveStribeckFriction,
    GrooveViscousFriction,
    MotionLag,
    PoseDelay,
    RustyPatch,
    SensorBias,
    SensorDelay,
    SensorGain,
    SensorGainDrift,
    SensorMounting,
    SensorResidualModel,
    SensorWarmUp,
)
from drake_disasm.logs import read_log
from drake_disasm.policies import Exploring, make_policy
from drake_disasm.scenario import load_scenario
from drake_disasm.task.recording import record_transitions
from drake_disasm.task.simulation import TaskSimulation
from sysid.models.twin import TwinModel
from sysid.objective import Objective
from sysid.parameters import Parameter
from sysid.scenario_parameters import ParameterRequest, scenario_parameters
from sysid.validation.blind_tests import nominal
from sysid.validation.synthetic_logs import transitions_log
from sysid.workers import Workers
from tests.drake_disasm.conftest import STIFF
from tests.drake_disasm.effects.learned_files import HEIGHT, step_in_fy

_NOTHING = np.zeros(0)
_STEPS = 30


def _scenario(contact):
    """On the stiff grip: the forces of several newtons tell the effects."""
    scenario = load_scenario("removal_turned", [STIFF, f"contact.model={contact}"])
    scenario.task.steps = _STEPS
    return scenario


def _log(folder, scenario, effect):
    real = copy.deepcopy(scenario)
    real.effects.append(effect)
    policy = Exploring(make_policy("admittance"), 1e-4, 0)
    simulation = TaskSimulation(real, "twin", policy)
    return real, record_transitions(folder, simulation, _STEPS)


def _error(log, scenario):
    """The rms residual of a model without parameters, in units of the noise."""
    model = TwinModel([log], scenario, ())
    measured = model.measurements
    error = (model.predictions(_NOTHING) - measured.values) / measured.noise
    return float(np.sqrt(np.mean(error**2)))


@pytest.mark.parametrize(
    "effect",
    [
        GrooveBend(kz=0.8),
        GrooveClearance(2e-4),
        GrooveViscousFriction(100.0),
        ChainPull(fx=-3.0, k=100.0),
        MotionLag(0.03),
        Backlash(x=4e-4, z=4e-4),
        Compliance(x=2e-5, z=2e-5),
        BoltSlip(x=3e-4),
        PoseDelay(0.13),
        SensorMounting(ry=0.1),
        SensorDelay(1.0, 0.1),
        SensorGainDrift(fx=0.2, ty=0.2),
    ],
    ids=lambda effect: type(effect).__name__,
)
def test_the_model_with_the_effect_explains_the_log_of_a_simulation(effect, tmp_path):
    scenario = _scenario("impact")
    real, log = _log(tmp_path / "log", scenario, effect)
    assert _error(log, real) < 0.85
    assert _error(log, scenario) > 2.0


@pytest.mark.slow
def test_local_effects_hold_with_hydroelastic_contact(tmp_path):
    scenario = _scenario("hydroelastic")
    real, log = _log(tmp_path / "log", scenario, RustyPatch(0.3, position=0.01))
    assert _error(log, real) < 1.3
    assert _error(log, scenario) > 2.0


def test_sensor_effects_share_one_simulation(tmp_path, monkeypatch):
    scenario = _scenario("impact")
    _, log = _log(tmp_path / "log", scenario, SensorMounting(ry=0.1))
    names = ["SensorBias.fx", "SensorGain.tz", "contact.friction"]
    scenario, parameters = scenario_parameters(
        scenario, [ParameterRequest(n) for n in names]
    )
    model = TwinModel([log], scenario, parameters)
    np.testing.assert_array_equal(model.simulated, [False, False, True])
    asked = []
    simulate_all = TwinModel.simulate_all

    def counted(self, thetas, rows):
        asked.extend(thetas)
        return simulate_all(self, thetas, rows)

    monkeypatch.setattr(TwinModel, "simulate_all", counted)
    thetas = np.array([[0.0, 0.0, 0.2], [0.5, 0.0, 0.2], [0.0, 0.1, 0.2], [0, 0, 0.3]])
    found = Objective(model, Workers()).residuals(thetas)
    assert len(asked) == 2
    change = (found[1] - found[0]) * model.measurements.noise
    np.testing.assert_allclose(change[:, 6], 0.5, atol=1e-9)
    alone = model.predict(thetas[2], slice(0, _STEPS)) - model.measurements.values
    np.testing.assert_allclose(found[2], alone / model.measurements.noise, atol=1e-9)


def test_a_step_begins_where_the_load_has_the_grip_not_the_reading(tmp_path):
    """In a simulation the grip that yields gives by the load."""
    scenario = load_scenario("removal", ["contact.model=impact"])
    real, log = _log(tmp_path / "log", scenario, SensorGain(fz=0.4))
    bare, stated = (TwinModel([log], s, ()) for s in (scenario, real))
    amplitude = Parameter("fz", 0.0, -0.5, 0.5, "", path="effects.0.fz")
    fitted = bare.with_effects([SensorGain()], [amplitude])
    theta = np.array([0.4])
    plain, begun = fitted.with_begins(np.zeros(1)), fitted.with_begins(theta)
    assert plain.with_begins(np.zeros(1)) is plain and begun.with_begins(theta) is begun
    assert plain.with_begins(theta) is not plain
    errors = [
        np.sqrt(np.mean((m.predictions(t) - m.measurements.values)[:, :3] ** 2))
        for m, t in (
            (plain, theta),
            (begun, theta),
            (stated.with_begins(_NOTHING), _NOTHING),
        )
    ]
    assert errors[1] < 0.7 * errors[0]
    np.testing.assert_allclose(errors[1], errors[2], rtol=1e-9)


def test_an_offset_that_the_first_readings_show_moves_no_bolt(tmp_path):
    scenario = load_scenario("removal", ["contact.model=impact"])
    real, log = _log(tmp_path / "log", scenario, SensorBias(ty=0.1))
    bare, stated = (TwinModel([log], s, ()) for s in (scenario, real))
    begins = [model._transitions.steps.wrench[:, 5] for model in (bare, stated)]
    np.testing.assert_allclose(*begins, atol=8e-3)
    read = log.episodes[0]["wrench"][:-1, 5]
    assert np.abs(read - begins[1]).max() > 0.08


def test_a_parameter_set_that_fails_leaves_the_others_of_its_batch(tmp_path):
    scenario = _scenario("impact")
    _, log = _log(tmp_path / "log", scenario, SensorMounting(ry=0.1))
    scenario, parameters = scenario_parameters(
        scenario, [ParameterRequest("part.clearance")]
    )
    model = TwinModel([log], scenario, parameters)
    thetas = np.array([[4e-4], [-1.0], [5e-4]])
    assert model.together >= len(thetas)
    found = model.simulate_all(thetas, slice(0, _STEPS))
    assert "part.clearance" in found[1]
    for i in (0, 2):
        alone = model.simulate(thetas[i], slice(0, _STEPS))
        np.testing.assert_allclose(found[i], alone, rtol=1e-9, atol=1e-11)


def test_a_learned_effect_knows_what_the_models_say_it_knows(tmp_path):
    """What it adds to predictions is its function of `residual_inputs`."""
    transitions_log(tmp_path / "log", nominal(), [], 0, episodes=2, steps=8)
    logs, theta = [read_log(tmp_path / "log")], np.zeros(0)
    learned = SensorResidualModel(str(step_in_fy(tmp_path)), share=1.0)
    model = TwinModel(logs, dataclasses.replace(nominal(), effects=[learned]), ())
    bare = model.with_effects(())
    more = model.predictions(theta) - bare.predictions(theta)
    inputs = bare.residual_inputs(theta)["fy"]
    inside = np.all(np.abs(inputs) <= 20.0, axis=1)
    expected = np.where(inside & (inputs[:, 0] > 0.0), HEIGHT, 0.0)
    assert 0 < np.count_nonzero(expected) < len(expected)
    channels = [c.name for c in bare.measurements.channels]
    np.testing.assert_allclose(more[:, channels.index("fy")], expected, atol=1e-9)
    rest = np.delete(more, channels.index("fy"), axis=1)
    np.testing.assert_allclose(rest, 0.0, atol=1e-9)


def test_shapes_that_would_be_another_effect_are_out_of_a_logs_reach(tmp_path):
    """A patch along the whole way, or a fall that no speed shows, is friction."""
    scenario = nominal()
    transitions_log(tmp_path / "log", scenario, [], 0, episodes=2, steps=_STEPS)
    model = TwinModel([read_log(tmp_path / "log")], scenario, ())
    assert model.reach.duration == pytest.approx(_STEPS * scenario.task.period)
    assert 0.01 < model.reach.way < 0.1 and 0.0 < model.reach.speed < 0.1
    for effect, field, most in (
        (RustyPatch(), "width", max(0.008, model.reach.way / 3.0)),
        (GrooveStribeckFriction(), "velocity", max(0.01, model.reach.speed)),
        (SensorWarmUp(), "time_constant", 30.0),
    ):
        path = f"effects.0.{field}"
        shape = Parameter(path, getattr(effect, field), 1e-4, 100.0, path=path)
        found = model.with_effects([effect], [shape])
        assert found.parameters[0].high == pytest.approx(most)
