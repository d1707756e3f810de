"""Closing the loop on logs of the twin: late poses, walls, scatter, budgets of time."""

import time

import numpy as np
import pytest

from drake_disasm.effects import (
    Backlash,
    CommandGain,
    GrooveBend,
    GroovePose,
    Imprecision,
    MotionLag,
    PoseDelay,
    SensorBias,
    SensorDeadBand,
    SensorDelay,
    SensorGain,
    SensorSaturation,
    registered_effects,
)
from drake_disasm.logs import read_log
from sysid.effect_selection.close_loop import close_loop
from sysid.effect_selection.output import to_mapping
from sysid.fitting.candidates import candidates
from sysid.fitting.fitter import Fitter
from sysid.fitting.settings import SelectionSettings
from sysid.models.twin import TwinModel
from sysid.report import closing_page
from sysid.residuals.command_scatter import _Likelihood, fit_command_scatter
from sysid.validation.blind_tests import nominal
from sysid.validation.synthetic_logs import transitions_log
from sysid.workers import Workers


def _model(folder, effects, **size) -> TwinModel:
    """Returns the nominal model of a log that was recorded with effects."""
    transitions_log(folder / "log", nominal(), effects, seed=0, **size)
    return TwinModel([read_log(folder / "log")], nominal(), ())


def test_a_pose_on_time_is_given_no_delay(tmp_path):
    library = [PoseDelay, MotionLag, SensorDelay]
    model = _model(tmp_path, [], episodes=8)
    assert close_loop(model, library=library).verdict.ending == "none"


@pytest.mark.slow
@pytest.mark.parametrize(
    "effect", [PoseDelay(0.1), MotionLag(0.03), Backlash(x=4e-4, z=4e-4)], ids=repr
)
def test_each_is_named_first_of_the_whole_library(effect, tmp_path):
    verdict = close_loop(_model(tmp_path, [effect])).verdict
    assert (verdict.names, verdict.ending) == ((type(effect).__name__,), "explained")


@pytest.mark.slow
def test_a_wrench_that_is_rows_late_is_found_far_from_the_data(tmp_path):
    library = [SensorDelay, SensorDeadBand, CommandGain]
    model = _model(tmp_path, [SensorDelay(1.0, 0.1)])
    verdict = close_loop(model, library=library).verdict
    assert (verdict.ending, verdict.names) == ("explained", ("SensorDelay",))
    share, delay = verdict.values
    assert share.value == pytest.approx(1.0, abs=1e-2)
    assert delay.value == pytest.approx(0.1, abs=1e-3)


@pytest.mark.slow
def test_a_groove_turned_by_three_degrees_is_named_and_measured(tmp_path):
    """Derivatives at null say nothing of it: the bolt is inside a wall."""
    model = _model(tmp_path, [GroovePose(ry=-0.0524)], episodes=6, steps=20)
    library = [GrooveBend, GroovePose, SensorGain, SensorSaturation]
    with Workers(2) as pool:
        closed = close_loop(model, test=[5], library=library, workers=pool)
    assert closed.first.objective > 10.0
    assert closed.verdict.ending == "explained", closed.text
    assert closed.verdict.names == ("GroovePose",)
    found = {value.name: value.value for value in closed.verdict.values}
    assert abs(found["GroovePose.ry"] + 0.0524) < 1e-3
    assert closed.errors.in_noise(closed.errors.after) < 1.1


def test_a_budget_of_time_ends_in_a_provisional_verdict_that_goes_on(tmp_path):
    model = _model(tmp_path, [CommandGain(x=0.03)], episodes=4, steps=8)
    library = [CommandGain, SensorBias]
    options = {"test": [3], "library": library, "folder": tmp_path / "fits"}
    first = close_loop(model, time_budget=0.0, **options)
    assert first.is_provisional and first.text.startswith("provisional: ")
    assert to_mapping(first)["provisional"] and not first.verdict.names
    found = close_loop(model, **options)
    assert not found.is_provisional and found.verdict.names == ("CommandGain",)
    assert "provisional" not in found.text


def test_candidates_that_the_time_was_not_enough_for_are_counted(tmp_path):
    model = _model(tmp_path, [SensorBias(fy=2.0)], episodes=4, steps=8)
    begin = time.monotonic()
    found = close_loop(model, test=[3], time_budget=1e-3)
    assert time.monotonic() - begin < 30.0  # of the machine's noise; 3 s alone
    count = len(found.search.untested)
    assert 0 < count < len(candidates(model, registered_effects()))
    assert f"{count} of them not yet" in found.text
    assert "tried so far" in found.sentence
    assert to_mapping(found)["untested"] == list(found.search.untested)
    assert f"{count} candidate effects" in closing_page(found, {})


def _scatter(model):
    fitter = Fitter(model, Workers(), model.default_huber_delta, SelectionSettings())
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
def test_closing_the_loop_adds_scatter_to_the_scenario(tmp_path):
    model = _model(tmp_path, [Imprecision(y=4e-5, z=4e-5)])
    library = [CommandGain, SensorBias, Imprecision]
    closed = close_loop(model, train=range(12), library=library)
    verdict = closed.verdict
    assert (verdict.ending, verdict.names) == ("explained", ("Imprecision",))
    [effect] = closed.scenario.effects
    assert isinstance(effect, Imprecision) and effect.x < effect.y


def test_what_scatter_leaves_has_unit_covariance_channel_by_channel():
    random = np.random.default_rng(0)
    rows, channels, std = 20_000, 6, np.array([2.0, 0.0, 5.0])
    J = random.standard_normal((channels, 3)) * np.ones((rows, 1, 1))
    r = np.einsum("nci,ni->nc", J, std * random.standard_normal((rows, 3)))
    r += random.standard_normal((rows, channels))
    likelihood = _Likelihood(r, J, np.inf)
    covariance = np.cov(likelihood.whitened(std).T)
    np.testing.assert_allclose(covariance, np.eye(channels), atol=0.04)
    np.testing.assert_allclose(likelihood.whitened(np.zeros(3)), r)
