"""An effect on the variance is told from effects on the mean."""

import numpy as np
import pytest

from drake_disasm.effects import (
    CommandGain,
    Imprecision,
    SensorBias,
    SensorDelay,
    SensorGain,
    SensorLag,
)
from drake_disasm.logs import read_log
from sysid.effect_selection.candidates import Candidate
from sysid.effect_selection.channel_checks import channel_findings
from sysid.effect_selection.close_loop import close_loop
from sysid.effect_selection.command_scatter import _Likelihood, fit_command_scatter
from sysid.effect_selection.fitter import Fitter
from sysid.effect_selection.settings import SelectionSettings
from sysid.models.twin import TwinModel
from sysid.validation.blind_tests import nominal
from sysid.validation.synthetic_logs import transitions_log
from sysid.workers import Workers


def _model(folder, effects, seed=0):
    transitions_log(folder / "log", nominal(), effects, seed)
    return TwinModel([read_log(folder / "log")], nominal(), ())


def _scatter(model):
    delta = model.default_huber_delta
    fitter = Fitter(model, Workers(), delta, SelectionSettings())
    return fit_command_scatter(fitter, fitter.fit(()))


@pytest.mark.slow
def test_finds_by_how_much_commands_scatter(tmp_path):
    """The encoders' noise is allowed for, which this simulated log does not have."""
    truth = np.array([0.0, 1e-4, 0.0])
    found = _scatter(_model(tmp_path, [Imprecision(*truth)]))
    np.testing.assert_allclose(found.std, truth, atol=5e-6)
    assert found.interval[1, 0] < 1e-4 < found.interval[1, 1]
    assert found.objective < 1.3 and found.gain > 0.9


@pytest.mark.parametrize(
    "effects",
    [[], pytest.param([CommandGain(z=0.3)], marks=pytest.mark.slow)],
    ids=["nothing", "CommandGain"],
)
def test_what_follows_on_something_is_no_scatter(effects, tmp_path):
    assert _scatter(_model(tmp_path, effects)) is None


@pytest.mark.slow
def test_closing_the_loop_adds_it_to_the_scenario(tmp_path):
    model = _model(tmp_path, [Imprecision(y=4e-5, z=4e-5)])
    episodes = range(len(model.measurements.names))
    library = [CommandGain, SensorBias, Imprecision]
    closed = close_loop(model, train=episodes, library=library)
    verdict = closed.verdict
    assert (verdict.ending, verdict.names) == ("explained", ("Imprecision",))
    assert "missing: Imprecision" in closed.text
    [effect] = closed.scenario.effects
    assert isinstance(effect, Imprecision) and effect.x < effect.y


def test_what_scatter_leaves_has_unit_covariance_channel_by_channel():
    random = np.random.default_rng(0)
    rows, channels, std = 20_000, 6, np.array([2.0, 0.0, 5.0])
    J = random.standard_normal((channels, 3)) * np.ones((rows, 1, 1))
    r = np.einsum("nci,ni->nc", J, std * random.standard_normal((rows, 3)))
    r += random.standard_normal((rows, channels))
    whitened = _Likelihood(r, J, np.inf, SelectionSettings()).whitened(std)
    np.testing.assert_allclose(np.cov(whitened.T), np.eye(channels), atol=0.04)
    nothing = _Likelihood(r, J, np.inf, SelectionSettings()).whitened(np.zeros(3))
    np.testing.assert_allclose(nothing, r)


@pytest.mark.slow
@pytest.mark.parametrize("is_scatter", [True, False])
def test_what_scatter_leaves_tells_whether_it_was_scatter(is_scatter, tmp_path):
    """A lag that the library lacks would nearly do as scatter; two channels tell."""
    lag = SensorLag(share=0.20810687472620154, time_constant=0.342796758218593)
    effect = Imprecision(x=3.4e-5, z=3.4e-5) if is_scatter else lag
    model = _model(tmp_path, [effect], 70000).of_episodes(range(9))
    delta = model.default_huber_delta
    fitter = Fitter.of(model, Workers(), delta, SelectionSettings())
    nearest = () if is_scatter else (SensorGain(), SensorDelay())
    fit = fitter.fit(tuple(map(Candidate.of, nearest)))
    scatter = fit_command_scatter(fitter, fit)
    assert scatter is not None
    found = {finding.channel for finding in channel_findings(scatter.left_of(fit))}
    assert not found if is_scatter else found >= {"tx", "ty"}
