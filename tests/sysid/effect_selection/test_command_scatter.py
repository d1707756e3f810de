"""An effect on the variance is told from effects on the mean."""

import numpy as np
import pytest

from drake_disasm.effects import (
    CommandGain,
    GrooveFriction,
    Imprecision,
    SensorBias,
)
from drake_disasm.logs import read_log
from sysid.effect_selection.close_loop import close_loop
from sysid.effect_selection.command_scatter import fit_command_scatter
from sysid.effect_selection.fitter import Fitter
from sysid.effect_selection.settings import SelectionSettings
from sysid.models.twin import TwinModel
from sysid.validation.blind_tests import nominal
from sysid.validation.synthetic_logs import transitions_log
from sysid.workers import Workers


def _model(folder, effects):
    transitions_log(folder / "log", nominal(), effects, 0)
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
    [
        [],
        pytest.param([CommandGain(z=0.3)], marks=pytest.mark.slow),
        pytest.param([GrooveFriction(0.1)], marks=pytest.mark.slow),
        pytest.param([SensorBias(fy=0.5)], marks=pytest.mark.slow),
    ],
    ids=lambda effects: "".join(type(e).__name__ for e in effects) or "nothing",
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
