"""A model of one's own, without a scenario, closed as a library call."""

import dataclasses
import json

import numpy as np
import pytest

from drake_disasm.common.errors import DisasmError
from drake_disasm.effects import (
    JointCoulombFriction,
    JointEffect,
    JointSamples,
    JointStribeckFriction,
    SensorBias,
    TorqueOffset,
)
from sysid.effect_selection.close_loop import close_loop
from sysid.effect_selection.exceeds_noise import exceeds_noise_p
from sysid.effect_selection.output import to_mapping
from sysid.effect_selection.verdict import judge
from sysid.effect_selection.verdict_words import verdict_sentence
from sysid.fitting.candidates import candidates
from sysid.fitting.fitter import Fitter
from sysid.fitting.settings import DEFAULT_SETTINGS
from sysid.models import Channel, LogModel, Measurements
from sysid.parameters import Parameter
from sysid.report import closing_page
from sysid.workers import Workers

_ROWS, _NOISE, _FRICTION = 300, 0.01, 0.3


class Pendulum(LogModel):
    """The torque that holds a pendulum on its way; of two episodes."""

    affine = True
    effect_types = (JointEffect,)

    def __init__(self, q, v, tau):
        self.q, self.v = q, v
        self.parameters = (Parameter("weight", 1.0, 0.0, 5.0, "N m"),)
        channels = [Channel("pivot", "N m", _NOISE, "as given")]
        self.measurements = Measurements.of_array(tau, channels)

    def predict(self, theta, rows):
        load = theta[0] * np.sin(self.q[rows])
        samples = JointSamples(self.q[rows], self.v[rows], 0.0 * load, load)
        effects = self.effects_at(theta)
        return (load + sum(effect.torque(samples) for effect in effects))[:, None]

    def select_rows(self, mask):
        return self.replace(q=self.q[mask], v=self.v[mask])


def _pendulum(friction, noise=_NOISE, kind=Pendulum, rows=_ROWS):
    """Returns a model of a log with so much friction, and noise."""
    random, t = np.random.default_rng(0), np.arange(rows) * 0.05
    q, v = np.sin(t) + 0.3 * np.sin(2.7 * t), np.cos(t) + 0.81 * np.cos(2.7 * t)
    tau = 2.0 * np.sin(q) + friction * np.sign(v)
    return kind(q, v, (tau + noise * random.standard_normal(rows))[:, None])


@pytest.fixture(scope="module")
def pendulum():
    return _pendulum(_FRICTION)


@pytest.fixture(scope="module")
def closed(pendulum):
    return close_loop(pendulum)


def test_all_but_the_model_has_a_default(closed):
    assert closed.verdict.ending == "explained"
    assert closed.verdict.names[0] == "JointCoulombFriction.pivot"
    found = {value.name: value for value in closed.verdict.values}
    friction = found["JointCoulombFriction.pivot.size"]
    assert friction.value == pytest.approx(_FRICTION, abs=0.02)
    assert friction.excludes_null and friction.unit == "N m"
    assert closed.errors.in_noise(closed.errors.after) < 1.3


def test_there_is_no_scenario_and_a_report_all_the_same(closed):
    assert closed.scenario is None
    assert "JointCoulombFriction" in closing_page(closed, {})
    mapping = json.loads(json.dumps(to_mapping(closed)))
    assert mapping["effects"] == list(closed.verdict.names)
    assert mapping["sentence"] == closed.sentence


def test_prints_nothing_unless_progress_is_given(pendulum, capsys):
    updates = []
    close_loop(pendulum, library=[JointCoulombFriction], progress=updates.append)
    assert capsys.readouterr() == ("", "") and updates


def test_an_unexplained_residual_beyond_the_stated_noise_is_called_so(pendulum):
    found = close_loop(pendulum, library=[TorqueOffset])
    assert found.verdict.ending == "unexplained"
    assert found.verdict.excess == pytest.approx(_FRICTION / _NOISE, rel=0.2)
    assert "no effect of the library explains" in found.sentence


def test_a_log_that_could_not_have_shown_most_effects_is_too_short():
    """A pendulum that creeps: what friction there is drowns in noise."""
    model = _pendulum(0.0)
    verdict = close_loop(Pendulum(model.q, 1e-6 * model.v, model.measurements.values))
    verdict = verdict.verdict
    assert (verdict.ending, verdict.names) == ("too short", ())
    assert "JointViscousFriction" in verdict.undetectable


def test_a_large_error_is_no_noise_whatever_else_passed():
    found = close_loop(_pendulum(0.0), library=[JointCoulombFriction])
    assert found.verdict.ending == "none"
    errors = dataclasses.replace(found.errors, after=0.6 * found.errors.measured)
    verdict = judge(found.search, errors)
    assert verdict.ending == "unexplained"
    assert verdict.relative_error == pytest.approx(0.4)
    assert "40 % of the torque, which is large" in verdict_sentence(verdict, errors)


def test_a_model_on_which_no_effect_can_act_is_refused(pendulum):
    with pytest.raises(DisasmError, match=r"Pendulum.* effect_types"):
        close_loop(pendulum, library=[SensorBias])


class Simulated(Pendulum):
    """The same, of which nobody says that effects are linear."""

    affine = False


def test_fits_select_what_the_linear_account_does():
    library = [JointCoulombFriction, JointStribeckFriction, TorqueOffset]
    found = close_loop(_pendulum(_FRICTION, kind=Simulated), library=library)
    assert found.verdict.confirmed == ("JointCoulombFriction.pivot",)
    assert found.verdict.ending == "explained"


@pytest.mark.slow
def test_trials_side_by_side_are_those_one_by_one():
    library = [JointCoulombFriction, JointStribeckFriction, TorqueOffset]
    found = []
    for count in (1, 2):
        with Workers(count) as workers:
            model = _pendulum(_FRICTION, kind=Simulated)
            found.append(close_loop(model, library=library, workers=workers).text)
    assert found[0] == found[1]


def test_a_force_that_shows_in_three_rows_has_to_exceed_the_stated_noise():
    """And what the model may be off by itself."""
    for friction, model_error, is_found in (
        (0.2, 0.0, True),
        (0.03, 0.03, False),
        (0.2, 0.03, True),
    ):
        model = _pendulum(0.0, kind=Simulated)
        moving, tau = [40, 140, 240], model.measurements.values.copy()
        still = np.zeros(_ROWS)
        still[moving] = 1.0
        model = Simulated(model.q, still, tau)
        tau[moving] += friction
        measured = model.measurements.with_values(tau)
        if model_error:
            error = model_error * np.abs(still)[:, None]
            measured = dataclasses.replace(measured, model_error=error)
        fitter = Fitter(
            model.with_measurements(measured), Workers(), np.inf, DEFAULT_SETTINGS
        )
        (effect, *_) = candidates(fitter.base, [JointCoulombFriction])
        before, after = fitter.fit(()), fitter.fit((effect.only(["size"]),))
        assert (exceeds_noise_p(before, after, 1) < 1e-3) == is_found
        assert after.values["JointCoulombFriction.pivot.size"] == pytest.approx(
            friction, abs=0.03
        )
