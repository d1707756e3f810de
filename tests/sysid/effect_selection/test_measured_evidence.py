"""What exceeds the noise: of effects that show in a few rows alone."""

import dataclasses

import numpy as np
import pytest

from drake_disasm.effects import JointCoulombFriction, JointEffect, JointSamples
from sysid.effect_selection.candidates import candidates
from sysid.effect_selection.evidence import Evidence
from sysid.effect_selection.fitter import Fitter
from sysid.effect_selection.measured_evidence import (
    amplitude_p,
    exceeds_noise_p,
    linear_p,
    measured_evidence,
)
from sysid.effect_selection.settings import SelectionSettings
from sysid.effect_selection.survey import survey_candidates
from sysid.effect_selection.verdict import parameter_values
from sysid.models import Channel, LogModel, Measurements
from sysid.workers import Workers

_ROWS, _NOISE, _MOVING = 300, 0.01, [40, 140, 240]
_SETTINGS = SelectionSettings()


class Stuck(LogModel):
    """A joint that moves in three of 300 rows, so that friction acts in them alone."""

    effect_types = (JointEffect,)

    def __init__(self, tau, model_error=0.0):
        self.v = np.zeros(_ROWS)
        self.v[_MOVING] = 1.0
        self.parameters = ()
        channels = [Channel("joint", "N m", _NOISE, "stated")]
        measured = Measurements.of_array(tau[:, None], channels)
        if model_error:
            error = model_error * np.abs(self.v)[:, None]
            measured = dataclasses.replace(measured, model_error=error)
        self.measurements = measured

    def predict(self, theta, rows):
        v = self.v[rows]
        samples = JointSamples(0.0 * v, v, 0.0 * v, 0.0 * v)
        effects = self.effects_at(theta)
        return sum((e.torque(samples) for e in effects), 0.0 * v)[:, None]

    def select_rows(self, mask):
        return self.replace(v=self.v[mask])


def _fitter(friction, model_error=0.0, seed=0):
    """A fitter of a log that has so much friction, and the candidate."""
    noise = _NOISE * np.random.default_rng(seed).standard_normal(_ROWS)
    noise[_MOVING] += friction
    model = Stuck(noise, model_error)
    effect = candidates(model, [JointCoulombFriction])[0].only(["size"])
    return Fitter(model, Workers(), np.inf, _SETTINGS), effect


def _fits(friction, model_error=0.0, seed=0):
    """Fits without and with friction to a log that has so much of it."""
    fitter, effect = _fitter(friction, model_error, seed)
    return fitter.fit(()), fitter.fit((effect,))


def _evidence(before, after):
    blank = Evidence(after.effects, 0.0, 1.0, 0.0, 1, np.zeros(1), _SETTINGS)
    return measured_evidence(before, after, blank, tests=70)


def test_what_shows_three_times_is_found_where_the_noise_is_known():
    """Of three blocks, no signs nor ranks could: 0.25 is their least p-value."""
    before, after = _fits(0.2)
    assert _evidence(before, after).accepted
    unknown = dataclasses.replace(after, noise_is_stated=False)
    assert _evidence(before, unknown).p == 1.0
    found = after.values["JointCoulombFriction.joint.size"]
    assert found == pytest.approx(0.2, abs=0.02)


def test_chance_is_taken_for_an_effect_as_often_as_it_says():
    p = [exceeds_noise_p(*_fits(0.0, seed=seed), 1) for seed in range(100)]
    # Friction is of one sign: chance makes some in half of the logs.
    assert 1 <= np.sum(np.array(p) < 0.1) <= 12  # of 100, at 0.05


def test_an_effect_has_to_exceed_what_the_model_itself_is_off_by():
    """By 0.03 N m in each row that moves, and always to the same side if need be."""
    before, after = _fits(0.03, model_error=0.03)
    assert not _evidence(before, after).accepted
    assert amplitude_p(after, 0) > 0.05
    (value,) = parameter_values(after, 0)
    assert value.interval[0] <= 0.01 < 0.05 <= value.interval[1]
    before, after = _fits(0.2, model_error=0.03)
    assert _evidence(before, after).accepted and amplitude_p(after, 0) < 1e-3


@pytest.mark.parametrize("friction", [0.03, 0.2])
def test_the_linear_account_says_what_a_fit_would(friction):
    fitter, effect = _fitter(friction, model_error=0.03)
    before, after = fitter.fit(()), fitter.fit((effect,))
    survey = survey_candidates(fitter, before, [effect])
    (evidence,) = survey.effects
    p = linear_p(before, survey.linearised, evidence)
    assert p == pytest.approx(exceeds_noise_p(before, after, 1), rel=1e-2)
    assert (p < 0.5) == (friction > 0.1)
