"""What a fit says of itself, and that it ends at the bottom of its valley."""

import dataclasses

import numpy as np
import pytest

from drake_disasm.effects import CommandGain
from drake_disasm.logs import read_log
from sysid.fitting.candidates import candidates
from sysid.fitting.fitter import Fitter
from sysid.fitting.settings import SelectionSettings
from sysid.models.twin import TwinModel
from sysid.validation.blind_tests import nominal
from sysid.validation.synthetic_logs import transitions_log
from sysid.workers import Workers


def _fitter(folder, effect, episodes=6):
    """Returns a fitter of a log that has an effect, and the candidate of its kind."""
    transitions_log(folder / "log", nominal(), [effect], 0, episodes, steps=12)
    model = TwinModel([read_log(folder / "log")], nominal(), ())
    (candidate,) = candidates(model, [type(effect)])
    delta = model.default_huber_delta
    return Fitter(model, Workers(), delta, SelectionSettings()), candidate


@pytest.fixture(scope="module")
def gain(tmp_path_factory):
    """Of an arm that goes 3 % too far along x."""
    return _fitter(tmp_path_factory.mktemp("gain"), CommandGain(x=0.03))


def test_an_effect_is_worth_what_the_loss_rises_by_without_it(gain):
    fitter, effect = gain
    before, fit = fitter.fit(()), fitter.fit((effect,))
    assert fit.effect_gains["CommandGain"] == pytest.approx(
        1 - fit.loss / before.loss, abs=0.04
    )
    (x,) = fit.columns_of(effect.only(["x"]))
    assert fit.theta[x] == pytest.approx(0.03, rel=0.02)


def test_losses_of_channels_add_up_to_those_of_folds(gain):
    fitter, effect = gain
    fit = fitter.fit((effect,))
    free = np.flatnonzero(~fit.is_at_bound)
    folds = fit.equations.folds(fit.settings.folds)
    assert fit.held_out_losses.shape == (len(folds.rows), 12)
    np.testing.assert_allclose(
        fit.held_out_losses.sum(axis=1), folds.held_out(free), rtol=1e-9
    )


def test_amplitudes_at_null_and_at_a_bound_are_none(gain):
    fitter, effect = gain
    fit = fitter.fit((effect.only(["x", "z"]),))
    assert fit.without_unphysical(0) == fit.effects
    _, z = fit.columns_of(fit.effects[0])
    u = fit.linearisation.u.copy()
    u[z] = 1.0
    linear = dataclasses.replace(fit.linearisation, u=u)
    (kept,) = dataclasses.replace(fit, linearisation=linear).without_unphysical(0)
    assert kept.fields == ("x",)


def test_noise_is_reached_channel_by_channel(gain):
    """A loud channel is no noise, however silent all the others are."""
    fitter, effect = gain
    fit = fitter.fit((effect,))
    residual = 0.1 * np.ones_like(fit.linearisation.residual)
    for size, is_noise in ((1.0, True), (2.0, False)):
        residual[:, 3] = size
        linear = dataclasses.replace(fit.linearisation, residual=residual.copy())
        rms = float(np.sqrt(np.mean(residual**2)))
        found = dataclasses.replace(fit, linearisation=linear, objective=rms)
        assert found.is_at_noise == is_noise
        assert not dataclasses.replace(found, noise_is_stated=False).is_at_noise


def test_noise_is_reached_where_no_reading_shows_how_a_step_begins(gain, monkeypatch):
    """In the rows that depend on it a residual of that size is none."""
    fitter, effect = gain
    fit = fitter.fit((effect,))
    residual = 0.5 * np.ones_like(fit.linearisation.residual)
    residual[:20] = 4.0
    linear = dataclasses.replace(fit.linearisation, residual=residual)
    found = dataclasses.replace(fit, linearisation=linear, objective=1.5)
    assert not found.is_at_noise
    error = np.zeros_like(residual)
    error[:20] = 5.0
    monkeypatch.setattr(type(fit.model), "begin_error", lambda *_: error)
    assert dataclasses.replace(found).is_at_noise
    monkeypatch.setattr(
        type(fit.model), "begin_error", lambda *_: np.roll(error, 20, axis=0)
    )
    assert not dataclasses.replace(found).is_at_noise
