"""Limits of detection: effects as large as they say are found, most of the time."""

import dataclasses

import numpy as np
import pytest

from drake_disasm.effects import registered_effects
from sysid.effect_selection.candidates import candidates
from sysid.effect_selection.data_sufficiency import refuse_short_logs
from sysid.effect_selection.detection import detection_limits
from sysid.effect_selection.fitter import Fitter
from sysid.effect_selection.settings import SelectionSettings
from sysid.effect_selection.survey import survey_candidates
from sysid.models.from_logs import ModelChoice, model_of
from sysid.workers import Workers
from tests.refusals import refused
from tests.sysid.effect_selection import blind

_SETTINGS = SelectionSettings()
_LOGS = 20


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    """A hundred simulated readings of a sensor at rest, with nothing missing."""
    log = blind.static_log(tmp_path_factory.mktemp("null"), [], 0.0, 5)
    found = model_of([log], ModelChoice())
    noise = np.array([blind.FORCE_NOISE] * 3 + [blind.TORQUE_NOISE] * 3)
    return found.with_measurements(found.measurements.with_noise(noise, "stated"))


def _survey(model):
    fitter = Fitter(model, Workers(), np.inf, _SETTINGS)
    fit = fitter.fit(())
    return fit, survey_candidates(fitter, fit, candidates(model, registered_effects()))


@pytest.mark.slow
def test_four_of_five_are_found_at_the_limit(model):
    fit, survey = _survey(model)
    limits = {(x.effect, x.field): x for x in detection_limits(survey.linearised)}
    limit = limits["SensorCrossTalk", "fy_fx"]
    change = limit.amplitude * model.predictions(fit.theta)[:, 0]
    clean = model.predictions(fit.theta)
    found = []
    for seed in range(_LOGS):
        noise = np.random.default_rng(seed).standard_normal(clean.shape)
        values = clean + noise * model.measurements.noise
        values[:, 1] += change
        drawn = model.with_measurements(model.measurements.with_values(values))
        _, survey = _survey(drawn)
        found.append(
            any("SensorCrossTalk" in e.name for e in survey.effects if e.accepted)
        )
    assert np.mean(found) >= 0.5  # of 20 at 0.8: less in one of 300 times
    assert limit.unit == "1" and 1e-4 < limit.amplitude < 0.1


def test_more_noise_takes_larger_effects(model):
    _, survey = _survey(model)
    louder = model.measurements.values.copy()
    random = np.random.default_rng(1)
    louder += 3.0 * model.measurements.noise * random.standard_normal(louder.shape)
    _, other = _survey(model.with_measurements(model.measurements.with_values(louder)))
    quiet, loud = (
        {(x.effect, x.field): x.share for x in detection_limits(s.linearised)}
        for s in (survey, other)
    )
    one_sided = ("SensorSaturation", "share")  # whichever side noise has pushed it to
    assert np.isfinite([quiet[one_sided], loud[one_sided]]).all()
    shapes = {x.effect: x.shape for x in detection_limits(survey.linearised)}
    assert shapes["SensorWarmUp"].startswith("time_constant=")
    assert shapes["SensorGain"] == ""
    both = [key for key in quiet if np.isfinite(quiet[key])]
    ratio = np.median([loud[key] / quiet[key] for key in both])
    assert 2.0 < ratio < 5.0  # the noise is sqrt(1 + 9) times as large


def test_a_log_that_can_show_nothing_is_refused(model):
    fit, survey = _survey(model)
    limits = detection_limits(survey.linearised)
    refuse_short_logs(fit, limits)
    beyond = [dataclasses.replace(x, amplitude=None, share=1.5) for x in limits]
    with refused("no effect", "125 rows more"):
        refuse_short_logs(fit, beyond)
